// "Back to start", and the run's values for its rig file: shown as a diff, written once that is accepted.

import { by, log, post } from "./asking.js";
import { change } from "./knobs.js";

let back = []; // changes that lead back to the start
let proposal = null; // number of the diff that is shown

export function drawDeeds(state) {
  back = state.back ?? [];
  by("back").disabled = state.connection !== "live" || !back.length;
  by("back").title = back.length ? `Sets ${back.join(", ")}` : "Nothing is different from the start of the run.";
  by("write").disabled = !state.source || !state.values;
}

async function ask(path, body) {
  try {
    return await post(path, body);
  } catch {
    return { ok: false, said: "The page's server does not answer." };
  }
}

function show(title, said, text, number) {
  proposal = number ?? null;
  by("sheet-title").textContent = title;
  by("sheet-said").textContent = said;
  by("sheet-text").hidden = !text;
  by("sheet-text").replaceChildren(...(text ?? "").split("\n").map(line));
  by("sheet-accept").hidden = !proposal;
  if (!by("sheet").open) by("sheet").show(); // not modal: STOP stays within reach of pointer and keys
  by(proposal ? "sheet-accept" : "sheet-close").focus();
}

function line(text) {
  const element = document.createElement("span");
  element.textContent = `${text}\n`;
  element.className = { "+": "added", "-": "removed", "@": "place" }[text[0]] ?? "";
  return element;
}

async function propose() {
  const reply = await ask("rig-diff");
  const name = reply.source ?? "rig.toml";
  if (!reply.ok) show("Not written", reply.said);
  else if (reply.diff) show(`Write to ${name}?`, "Comments and layout stay. Nothing is written until you accept.", reply.diff, reply.proposal);
  else if (reply.command) show("A shipped rig has no file", `Start it with these values, or copy it first: dcmp-hil rigs --copy ${name} my-rig.toml`, reply.command);
  else show("Nothing to write", `${name} has these values already.`);
}

async function accept() {
  const reply = await ask("rig-write", { proposal });
  log(reply);
  show(reply.ok ? "Written" : "Not written", reply.said);
}

function close() {
  by("sheet").close();
  by("write").focus();
}

by("back").addEventListener("click", () => change(back));
by("write").addEventListener("click", propose);
by("sheet-accept").addEventListener("click", accept);
by("sheet-close").addEventListener("click", close);
