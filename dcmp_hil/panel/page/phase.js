// Phase, banner and header: how the run is, in words.

import { by } from "./asking.js";
import { confirmed, doubtOfStop, drawStop } from "./stop.js";

const STARTING = ["arming", "probing", "settling", "engaging"];
const WORDS = { none: "no run", ended: "run ended", silent: "no answer" };
const say = (id, text) => {
  if (by(id).textContent !== text) by(id).textContent = text; // a screen reader reads what changes
};

function sentence(state) {
  if (state.connection === "live") return state.fault ? `Fault: ${state.fault}` : "";
  return {
    none: "No run yet. Start one with `dcmp-hil run`: this page finds it.",
    ended: `Run ended: ${state.ended} The next one is found by itself.`,
    silent: "The command process does not answer. The run goes on; STOP works all the same.",
    lost: "The page's server is gone: start `dcmp-hil panel` again. STOP is Ctrl-C where the run was started.",
  }[state.connection];
}

// Whether the run ended by something that needs a look.
export const endedBadly = (state) => state.last_phase === "tripped" || state.at_zero === false;

export function drawPhase(state) {
  const live = state.connection === "live";
  say("phase", live ? state.phase : WORDS[state.connection] ?? "no connection");
  by("phase").className = "badge";
  if (live) by("phase").classList.add(STARTING.includes(state.phase) ? "starting" : state.stopping ? "stopping" : state.phase);
  document.body.classList.toggle("dead", !live);
  drawStop(live, state.connection === "silent", state.stopping);
  if (state.rig) say("rig", state.rig);
  say("process", state.pid ? `process ${state.pid}` : "");
  say("time", typeof state.t_s === "number" ? `${state.t_s.toFixed(1)} s` : "");
  if (state.connection === "ended" || state.connection === "none" || (live && state.stopping)) confirmed();
  const doubt = doubtOfStop();
  say("banner", doubt || sentence(state));
  by("banner").hidden = !by("banner").textContent;
  const bad = doubt || (live && state.fault) || state.connection === "lost" || (state.connection === "ended" && endedBadly(state));
  by("banner").classList.toggle("bad", Boolean(bad));
}
