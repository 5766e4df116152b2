// STOP: a script of its own, which works with any error in the rest of the page.

import { by, log, post } from "./asking.js";

const CONFIRM_MS = 1000; // for STOP to be confirmed in

// The server's clock as this page knows it: a STOP that is older than a second when it is read is dropped there.
let serverClock = null; // [server_ms, performance.now() when it came]
const serverNow = () => (serverClock ? serverClock[0] + performance.now() - serverClock[1] : undefined);
let doubt = ""; // of a STOP that is not confirmed

export function setClock(serverMs) {
  serverClock = [serverMs, performance.now()];
}

// What the banner says of a STOP that is not confirmed.
export const doubtOfStop = () => doubt;

function doubtStop(sentence) {
  doubt = sentence;
  if (sentence) {
    by("banner").textContent = sentence;
    by("banner").hidden = false;
    by("banner").classList.add("bad");
  }
}

export const confirmed = () => doubtStop("");

// STOP can be pressed unless it is known that there is no run.
export function drawStop({ connection, stopping }) {
  by("stop").disabled = connection === "none" || connection === "ended";
  const live = connection === "live";
  if (live && !stopping && by("stop").textContent !== "STOPEsc") by("stop").innerHTML = "STOP<small>Esc</small>";
  if (!live) by("stop").textContent = "STOP";
}

async function stop() {
  by("stop").textContent = "STOPPING …";
  const late = setTimeout(
    () => doubtStop("STOP not confirmed: no answer for a second. Press Ctrl-C where the run was started, or the e-stop."),
    CONFIRM_MS,
  );
  let reply;
  try {
    reply = await post("stop", { pressed_ms: serverNow() });
  } catch {
    reply = { ok: false, said: "STOP not confirmed: the page's server does not answer. Press Ctrl-C where the run was started." };
  }
  clearTimeout(late);
  doubtStop(reply.ok ? "" : reply.said);
  log(reply);
}

by("stop").addEventListener("click", stop);
document.addEventListener("keydown", (event) => {
  if (event.key === "Escape") stop();
}, { capture: true });
