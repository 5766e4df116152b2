// Sliders, number fields and choices. A value shows as applied only once the run has read it back.

import { by, log, post } from "./asking.js";

const EVERY_MS = 150; // between two changes while a slider moves
const GROUPS = { controller: "Controller", observer: "Observer", reference: "Reference" };
const rows = new Map(); // key -> what draws it
let shape = "";

const round = (value) => Number(value.toPrecision(4));
const unit = (text) => text.replace(/2\b/g, "²").replace(/3\b/g, "³");
const shown = (value) => (typeof value === "number" ? String(Number(value.toPrecision(6))) : value);
const bounds = ({ low, high, unit: name }) => {
  const ends = [low === null ? "" : `from ${shown(low)}`, high === null ? "" : `to ${shown(high)}`].filter(Boolean).join(" ");
  return ends ? `Allowed: ${ends} ${unit(name)}`.trimEnd() : "Any number is allowed";
};
const toSlider = (knob, value) => (knob.decades ? Math.log10(value) : value);
const fromSlider = (knob, value) => (knob.decades ? 10 ** value : value);

class Row {
  constructor(knob) {
    this.knob = knob;
    this.wanted = null; // what was asked for and is not read back yet
    this.asking = false;
    this.last = 0;
  }

  async want(value) {
    this.wanted = value;
    this.draw();
    if (this.asking) return;
    this.asking = true;
    while (this.wanted !== null) {
      const now = this.wanted;
      const wait = this.last + EVERY_MS - performance.now();
      if (wait > 0) await new Promise((done) => setTimeout(done, wait));
      if (this.wanted !== now) continue;
      this.last = performance.now();
      const reply = await change([`${this.knob.key}=${now}`]);
      this.element.classList.toggle("refused", !reply.ok);
      if (reply.ok) this.knob.value = now;
      if (this.wanted === now) this.wanted = null;
    }
    this.asking = false;
    this.draw();
  }
}

class Slider extends Row {
  constructor(knob) {
    super(knob);
    const name = knob.key.split(".")[1].replace(new RegExp(`_${knob.unit.replaceAll("/", "_")}$`), "");
    const range = `${shown(round(knob.slider[0]))} … ${shown(round(knob.slider[1]))} ${unit(knob.unit)}`;
    this.element = document.createElement("div");
    this.element.className = "knob";
    this.element.title = `${knob.key}: ${knob.meaning} ${bounds(knob)}.`;
    this.element.innerHTML = '<label><b></b><span></span></label><output class="applied"></output><input type="range"><input type="number" step="any">';
    const [label, applied, slider, number] = this.element.children;
    [label.children[0].textContent, label.children[1].textContent] = [name, range];
    [slider.id, number.id, applied.id] = ["slider", "number", "applied"].map((what) => `${what}-${knob.key}`);
    label.htmlFor = slider.id;
    [slider.ariaLabel, number.ariaLabel] = [`${knob.key} slider`, `${knob.key} in ${knob.unit || "numbers"}`];
    applied.ariaLabel = `${knob.key} applied`;
    for (const input of [slider, number]) input.setAttribute("aria-describedby", applied.id);
    [slider.min, slider.max] = knob.slider.map((value) => toSlider(knob, value));
    slider.step = (slider.max - slider.min) / 400;
    [number.min, number.max] = [knob.low ?? "", knob.high ?? ""]; // null: no bound
    slider.addEventListener("input", () => this.want(round(fromSlider(knob, Number(slider.value)))));
    number.addEventListener("change", () => {
      if (number.value !== "") this.want(Number(number.value));
    });
    Object.assign(this, { slider, number, applied });
  }

  draw() {
    const value = this.wanted ?? this.knob.value;
    const near = toSlider(this.knob, value);
    if (Math.abs(Number(this.slider.value) - near) > Number(this.slider.step)) this.slider.value = near;
    const words = `${shown(value)} ${this.knob.unit}`;
    if (this.slider.ariaValueText !== words) this.slider.ariaValueText = words;
    if (document.activeElement !== this.number && this.number.value !== shown(value)) this.number.value = shown(value);
    if (this.applied.textContent !== shown(this.knob.value)) this.applied.textContent = shown(this.knob.value);
    this.element.classList.toggle("waiting", this.wanted !== null);
  }
}

class Choice extends Row {
  constructor(knob) {
    super(knob);
    this.element = document.createElement("select");
    this.element.id = `choice-${knob.key}`;
    this.element.ariaLabel = knob.key;
    this.element.append(...[...new Set([...knob.choices, knob.value])].map((kind) => new Option(kind, kind)));
    this.element.addEventListener("change", () => this.want(this.element.value));
  }

  draw() {
    if (document.activeElement !== this.element || this.wanted === null) this.element.value = this.wanted ?? this.knob.value;
  }
}

function build(knobs) {
  rows.clear();
  const groups = new Map();
  for (const knob of knobs) {
    const section = knob.key.split(".")[0];
    if (!groups.has(section)) {
      const group = document.createElement("fieldset");
      group.className = "group";
      group.innerHTML = "<legend></legend>";
      group.firstChild.textContent = GROUPS[section];
      groups.set(section, group);
    }
    const row = knob.choices ? new Choice(knob) : new Slider(knob);
    groups.get(section).append(row.element);
    rows.set(knob.key, row);
  }
  by("knobs").replaceChildren(...groups.values());
}

// Ask for changes, and show the answer.
export async function change(changes) {
  let reply;
  try {
    reply = await post("set", { changes });
  } catch {
    reply = { ok: false, said: "The page's server does not answer." };
  }
  log(reply);
  return reply;
}

export function drawKnobs(knobs, live) {
  const now = knobs.map((knob) => `${knob.key}${knob.slider ? "" : knob.choices.length}`).join();
  if (now !== shape) {
    shape = now;
    build(knobs);
  }
  for (const group of by("knobs").children) group.disabled = !live;
  for (const knob of knobs) {
    const row = rows.get(knob.key);
    row.knob.value = knob.value;
    row.draw();
  }
}
