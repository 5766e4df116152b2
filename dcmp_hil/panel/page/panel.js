// The page: takes a state from the server a few times a second, and has each part draw its share of it.

import { by, log } from "./asking.js";
import { drawKnobs } from "./knobs.js";
import { setMarks } from "./marks.js";
import { drawPhase, endedBadly, isOld } from "./phase.js";
import { describePlots, drawPlots, setLimit } from "./plots.js";
import { drawDeeds } from "./rig_file.js";
import { drawStop, setClock } from "./stop.js";
import { drawLate, drawTiles } from "./tiles.js";
import { add, clear, trace } from "./trace.js";

const DESCRIBE_MS = 2000; // between two descriptions of the plots in words
let state = { connection: "none" };
let asked = false; // for a picture
let described = 0;
const failed = new Set();

// An error in one part of the page is told once and stops no other part.
function guarded(name, draw) {
  try {
    draw();
  } catch (error) {
    if (!failed.has(name)) log({ ok: false, said: `This page cannot draw its ${name} (${error.message}). STOP works.` });
    failed.add(name);
  }
}

function picture() {
  asked = false;
  guarded("plots", drawPlots);
  if (performance.now() - described > DESCRIBE_MS) {
    described = performance.now();
    guarded("words", describePlots);
  }
}

function askForPicture() {
  if (asked) return;
  asked = true;
  requestAnimationFrame(picture);
}

// The newest state of the run; of one that does not answer, the words on it.
export function take(now) {
  guarded("STOP", () => drawStop(now)); // first: what fails after it leaves STOP as it must be
  if (typeof now.server_ms === "number") setClock(now.server_ms);
  if (now.pid && now.pid !== state.pid) guarded("trace", clear);
  state = ["lost", "unread"].includes(now.connection) ? { ...state, ...now } : now;
  const current = state.connection === "live" && typeof state.t_s === "number" && !isOld(state);
  guarded("phase", () => drawPhase(state));
  guarded("tiles", () => drawTiles(current ? state : null, state.at_zero));
  guarded("late", () => drawLate(state, current));
  guarded("knobs", () => drawKnobs(state.knobs ?? [], state.connection === "live"));
  guarded("deeds", () => drawDeeds(state));
  guarded("trace", () => {
    add(state.columns ?? [], now.buckets ?? []);
    setLimit(state.voltage_limit_V);
    const end = state.connection === "ended" && trace.t.length ? { t: trace.t.at(-1), trip: state.last_phase === "tripped", bad: endedBadly(state) } : null;
    setMarks(state.marks ?? [], end);
  });
  askForPicture();
}

// A state that cannot be read is one of a run that may be there.
export function read(text) {
  try {
    return JSON.parse(text);
  } catch {
    return { connection: "unread" };
  }
}

export const source = new EventSource("events");
source.addEventListener("message", ({ data }) => take(read(data)));
source.addEventListener("error", () => take({ connection: "lost" }));
new ResizeObserver(askForPicture).observe(by("charts"));

const viewer = document.body.dataset.viewer;
if (viewer) {
  by("viewer").src = viewer;
  by("viewer").hidden = false;
  document.body.classList.add("framed");
}
