// "Back to start", and the run's values for its rig file: shown as a diff, written once that is accepted.

import { by, log, post } from "./asking.js";
import { change } from "./knobs.js";

let back = []; // changes that lead back to the start
let kept = []; // what does not lead back
let proposal = null; // number of the diff that is shown

export function drawDeeds(state) {
  [back, kept] = [state.back ?? [], state.kept ?? []];
  by("back").disabled = state.connection !== "live" || !back.length;
  const sets = back.length ? `Sets ${back.join(", ")}.` : `Nothing${kept.length ? " else" : ""} is different from the start of the run.`;
  by("back").title = kept.length ? `${sets} ${notBack()}` : sets;
  by("write").disabled = !state.source || !state.values;
}

const notBack = () => `Not taken back: ${kept.join(", ")}, which is read before a run. Start another run with it.`;

async function ask(path, body) {
  try {
    return await post(path, body);
  } catch {
    return { ok: false, unanswered: true, said: "The page's server does not answer." };
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
  else if (reply.diff) show(`Write to ${name}?`, "All other lines stay as they are. Nothing is written until you accept.", reply.diff, reply.proposal);
  else if (reply.command) show("A shipped rig has no file", `Start it with these values, or copy it first: dcmp-hil rigs --copy ${name} my-rig.toml`, reply.command);
  else show("Nothing to write", `${name} has these values already.`);
}

async function accept() {
  by("sheet-accept").disabled = true; // a diff is accepted once
  const reply = await ask("rig-write", { proposal });
  by("sheet-accept").disabled = false;
  if (reply.unanswered) reply.said += " Whether the file was written is not known: look at it.";
  log(reply);
  show(reply.ok ? "Written" : reply.unanswered ? "Not confirmed" : "Not written", reply.said);
}

function close() {
  by("sheet").close();
  by("write").focus();
}

by("back").addEventListener("click", async () => {
  await change(back);
  if (kept.length) log({ ok: false, said: notBack() });
});
by("write").addEventListener("click", propose);
by("sheet-accept").addEventListener("click", accept);
by("sheet-close").addEventListener("click", close);
