// Phase, banner and header: how the run is, in words.

import { by } from "./asking.js";
import { confirmed, doubtOfStop } from "./stop.js";

const STARTING = ["arming", "probing", "settling", "engaging"];
const WORDS = { none: "no run", ended: "run ended", silent: "no answer", unseen: "not seen", unread: "not read" };
const say = (id, text) => {
  if (by(id).textContent !== text) by(id).textContent = text; // a screen reader reads what changes
};

function sentence(state) {
  if (state.connection === "live" && state.fault) return `Fault: ${state.fault}`;
  if (state.connection === "live") return isOld(state) ? "No cycle has come for half a second: nothing newer is known. STOP works all the same." : "";
  return {
    none: "No run yet. Start one with `dcmp-hil run`: this page finds it.",
    ended: `Run ended: ${state.ended} The next one is found by itself.`,
    silent: "The command process does not answer. The run goes on; STOP works all the same.",
    unseen: "The run's command process is gone: this page sees the run no more, and it may go on. STOP ends it all the same.",
    unread: "This page cannot read what the run says: reload it. STOP works all the same.",
    lost: "The page's server is gone: start `dcmp-hil panel` again. STOP is Ctrl-C where the run was started.",
  }[state.connection];
}

// Whether the values are those of a cycle that is long past.
export const isOld = (state) => state.phase === "silent";

// Whether the run ended by something that needs a look.
export const endedBadly = (state) => state.last_phase === "tripped" || state.at_zero === false;

export function drawPhase(state) {
  const live = state.connection === "live";
  say("phase", live ? state.phase : WORDS[state.connection] ?? "no connection");
  by("phase").className = "badge";
  if (live) by("phase").classList.add(STARTING.includes(state.phase) ? "starting" : state.stopping ? "stopping" : state.phase);
  document.body.classList.toggle("dead", !live);
  if (state.rig) say("rig", state.rig);
  say("process", state.pid ? `process ${state.pid}` : "");
  say("time", typeof state.t_s === "number" ? `${state.t_s.toFixed(1)} s` : "");
  if (state.connection === "ended" || state.connection === "none" || (live && state.stopping)) confirmed();
  const doubt = doubtOfStop();
  say("banner", doubt || sentence(state));
  by("banner").hidden = !by("banner").textContent;
  const bad = doubt || (live && state.fault) || ["lost", "unread", "unseen"].includes(state.connection) || (state.connection === "ended" && endedBadly(state));
  by("banner").classList.toggle("bad", Boolean(bad));
}
