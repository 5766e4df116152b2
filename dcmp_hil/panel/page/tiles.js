// The newest values as numbers. What was before is not shown as what is.

import { by } from "./asking.js";

const number = (value, digits) => (typeof value === "number" ? (value < 0 ? "−" : "+") + Math.abs(value).toFixed(digits) : "–");
const say = (id, text) => {
  if (by(id).textContent !== text) by(id).textContent = text;
};

// `state` is null where nothing of now is known: no run that answers, or no new cycle.
export function drawTiles(state, atZero) {
  const now = state ?? {};
  say("position", number(now.position_rad, 3));
  say("reference", `reference ${number(now.reference_rad, 3)}`);
  say("velocity", number(now.velocity_rad_s, 3));
  say("error", number(now.error_mrad, 2));
  say("voltage", !state && atZero ? "0.00" : number(now.voltage_V, 2));
  say("disturbance", number(now.disturbance_rad_s2, 2));
  for (const part of ["gravity", "friction", "rest"]) say(part, number(now[`${part}_rad_s2`], 1));
  const limit = now.voltage_limit_V;
  say("limit", limit ? `limit ± ${limit} V` : state ? "no limit" : "limit –");
  const part = limit ? Math.max(-1, Math.min(1, (now.voltage_V ?? 0) / limit)) : 0;
  by("meter").style.left = `${50 + 50 * Math.min(part, 0)}%`;
  by("meter").style.width = `${50 * Math.abs(part)}%`;
}

// Late cycles are counted: the number stays true after the end.
export function drawLate(state, current) {
  say("late", typeof state.late === "number" ? String(state.late) : "–");
  const lateness = typeof state.lateness_us === "number" && current ? `${number(state.lateness_us, 0)} µs` : "–";
  say("lateness", state.missed ? `${state.missed} cycles not seen here` : `newest ${lateness}`);
  by("late").classList.toggle("some", state.late > 0);
}
