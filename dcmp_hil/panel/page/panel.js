"use strict";
// What the page shows is what the run says; what it asks for shows as applied only once the run has read it back.

const by = (id) => document.getElementById(id);
const STARTING = ["arming", "probing", "settling", "engaging"];
const EVERY_MS = 150; // between two changes while a slider moves
const [LEAST_S, TRACE_S] = [2, 20]; // of time that the lines show
const GROUPS = { controller: "Controller", observer: "Observer", reference: "Reference" };
const LOG = 2; // lines
const CONFIRM_MS = 1000; // for STOP to be confirmed in

let state = { connection: "none" };
let shape = "";
const rows = new Map(); // key -> what draws it
const trace = [];

// ---------------------------------------------------------------- asking

async function post(path, body) {
  const answer = await fetch(path, {
    method: "POST",
    headers: { "Content-Type": "application/json" },
    body: JSON.stringify(body ?? {}),
  });
  if (!answer.headers.get("Content-Type").startsWith("application/json")) {
    return { ok: false, said: await answer.text() };
  }
  return answer.json();
}

function log(reply) {
  const line = document.createElement("li");
  line.textContent = reply.said;
  line.className = reply.ok ? "" : "bad";
  by("log").prepend(line);
  while (by("log").children.length > LOG) by("log").lastChild.remove();
}

// The server's clock as this page knows it: a STOP that is older than a second when it is read is dropped there.
let serverClock = null; // [server_ms, performance.now() when it came]
const serverNow = () => (serverClock ? serverClock[0] + performance.now() - serverClock[1] : undefined);

let doubt = ""; // what the banner says of a STOP that is not confirmed

function doubtStop(sentence) {
  doubt = sentence;
  drawState();
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
});

// ---------------------------------------------------------------- knobs

const round = (value) => Number(value.toPrecision(4));
const unit = (text) => text.replace(/2\b/g, "²").replace(/3\b/g, "³");
const shown = (value) => (typeof value === "number" ? String(Number(value.toPrecision(6))) : value);
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
      let reply;
      try {
        reply = await post("set", { changes: [`${this.knob.key}=${now}`] });
      } catch {
        reply = { ok: false, said: "The page's server does not answer." };
      }
      log(reply);
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
    this.element = document.createElement("div");
    this.element.className = "knob";
    this.element.title = `${knob.key}: ${knob.meaning} Allowed: ${shown(knob.low)} to ${shown(knob.high)} ${unit(knob.unit)}.`;
    this.element.innerHTML = '<label><b></b><span></span></label><output class="applied"></output><input type="range"><input type="number" step="any">';
    const [label, applied, slider, number] = this.element.children;
    label.children[0].textContent = name;
    label.children[1].textContent = `${shown(round(knob.slider[0]))} … ${shown(round(knob.slider[1]))} ${unit(knob.unit)}`;
    [slider.ariaLabel, number.ariaLabel] = [`${knob.key} slider`, `${knob.key} in ${knob.unit}`];
    [slider.id, number.id, applied.id] = ["slider", "number", "applied"].map((what) => `${what}-${knob.key}`);
    [slider.min, slider.max] = knob.slider.map((value) => toSlider(knob, value));
    slider.step = (slider.max - slider.min) / 400;
    [number.min, number.max] = [knob.low, knob.high];
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
    if (document.activeElement !== this.number) this.number.value = shown(value);
    this.applied.textContent = shown(this.knob.value);
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
    this.element.value = this.wanted ?? this.knob.value;
  }
}

function build(knobs) {
  rows.clear();
  const groups = new Map();
  for (const knob of knobs) {
    const section = knob.key.split(".")[0];
    if (!groups.has(section)) {
      const group = document.createElement("div");
      group.className = "group";
      group.innerHTML = "<h2><span></span></h2>";
      group.firstChild.firstChild.textContent = GROUPS[section];
      groups.set(section, group);
    }
    const row = knob.choices ? new Choice(knob) : new Slider(knob);
    const group = groups.get(section);
    (knob.choices ? group.firstChild : group).append(row.element);
    rows.set(knob.key, row);
  }
  by("knobs").replaceChildren(...groups.values());
}

function drawKnobs(knobs) {
  const now = knobs.map((knob) => `${knob.key}${knob.slider ? "" : knob.choices.length}`).join();
  if (now !== shape) {
    shape = now;
    build(knobs);
  }
  for (const knob of knobs) {
    const row = rows.get(knob.key);
    row.knob.value = knob.value;
    row.draw();
  }
}

// ---------------------------------------------------------------- numbers

const number = (value, digits) => (typeof value === "number" ? (value < 0 ? "−" : "+") + Math.abs(value).toFixed(digits) : "–");

function drawNumbers() {
  by("position").textContent = number(state.position_rad, 3);
  by("reference").textContent = typeof state.reference_rad === "number" ? `reference ${number(state.reference_rad, 3)}` : "";
  by("velocity").textContent = number(state.velocity_rad_s, 3);
  by("error").textContent = number(state.error_mrad, 2);
  by("voltage").textContent = number(state.voltage_V, 2);
  const limit = state.voltage_limit_V;
  by("limit").textContent = limit ? `limit ± ${limit} V` : "";
  const part = limit ? Math.max(-1, Math.min(1, (state.voltage_V ?? 0) / limit)) : 0;
  by("meter").style.left = `${50 + 50 * Math.min(part, 0)}%`;
  by("meter").style.width = `${50 * Math.abs(part)}%`;
}

const LANES = [
  { title: "position, reference", unit: "rad", digits: 2, lines: [["reference_rad", "#5abe5f"], ["position_rad", "#9fb6cc"]] },
  { title: "tracking error", unit: "mrad", digits: 1, lines: [["error_mrad", "#f05050"]] },
  { title: "voltage", unit: "V", digits: 1, lines: [["voltage_V", "#4696f5"]] },
];

function drawTrace() {
  const canvas = by("trace");
  const [width, height] = [canvas.clientWidth, canvas.clientHeight];
  const scale = window.devicePixelRatio;
  [canvas.width, canvas.height] = [width * scale, height * scale]; // clears it
  if (!trace.length || !width) return;
  const pen = canvas.getContext("2d");
  pen.scale(scale, scale);
  pen.font = "12px system-ui, sans-serif";
  const end = trace.at(-1).t_s;
  const span = Math.max(LEAST_S, Math.min(TRACE_S, end - trace[0].t_s));
  const left = 64;
  const x = (t) => left + (width - left - 4) * (1 - (end - t) / span);
  LANES.forEach((lane, k) => {
    const [top, tall] = [(k * height) / LANES.length + 22, height / LANES.length - 28];
    const values = trace.flatMap((one) => lane.lines.map(([name]) => one[name])).filter((v) => typeof v === "number");
    if (!values.length) return;
    let [low, high] = [Math.min(...values, 0), Math.max(...values, 0)];
    if (high - low < 1e-6) [low, high] = [-1, 1];
    const y = (value) => top + tall * (1 - (value - low) / (high - low));
    pen.fillStyle = "#8b98a8";
    pen.textAlign = "left";
    pen.fillText(`${lane.title}, ${lane.unit}`, left, top - 8);
    pen.textAlign = "right";
    if (k === 0) pen.fillText(`last ${span.toFixed(0)} s`, width - 6, top - 8);
    for (const value of new Set([low, 0, high])) {
      const far = value === 0 || Math.abs(y(value) - y(0)) > 12;
      if (far) pen.fillText(value.toFixed(lane.digits).replace("-", "−"), left - 8, y(value) + 4);
      pen.strokeStyle = value === 0 ? "#3a4655" : "#222a34";
      pen.lineWidth = 1;
      pen.beginPath();
      pen.moveTo(left, y(value));
      pen.lineTo(width, y(value));
      pen.stroke();
    }
    for (const [name, colour] of lane.lines) {
      pen.strokeStyle = colour;
      pen.lineWidth = 1.8;
      pen.beginPath();
      for (const one of trace) if (typeof one[name] === "number") pen.lineTo(x(one.t_s), y(one[name]));
      pen.stroke();
    }
  });
}

function drawState() {
  const live = state.connection === "live";
  const phase = by("phase");
  const words = { none: "no run", ended: "run ended", silent: "no answer" };
  phase.textContent = live ? state.phase : words[state.connection] ?? "no connection";
  phase.className = "badge";
  if (live) phase.classList.add(STARTING.includes(state.phase) ? "starting" : state.stopping ? "stopping" : state.phase);
  document.body.classList.toggle("dead", !live);
  by("stop").disabled = !live && state.connection !== "silent";
  if (live && !state.stopping) by("stop").innerHTML = "STOP<small>Esc</small>";
  if (!live) by("stop").textContent = "STOP";
  if (state.rig) by("rig").textContent = state.rig;
  by("process").textContent = state.pid ? `process ${state.pid}` : "";
  by("time").textContent = typeof state.t_s === "number" ? `${state.t_s.toFixed(1)} s` : "";
  const sentences = {
    none: "No run yet. Start one with `dcmp-hil run`: this page finds it.",
    ended: `The run has ended: ${state.ended} The next one is found by itself.`,
    silent: "The command process does not answer. The run goes on; STOP works all the same.",
    lost: "The page's server is gone: start `dcmp-hil panel` again. STOP is Ctrl-C where the run was started.",
  };
  const banner = by("banner");
  if (state.connection === "ended" || state.connection === "none" || (live && state.stopping)) doubt = "";
  banner.textContent = doubt || (live ? state.fault : sentences[state.connection]);
  banner.hidden = !banner.textContent;
  banner.classList.toggle("bad", Boolean(doubt) || Boolean(state.fault) || state.connection === "lost");
}

function take(now) {
  if (typeof now.server_ms === "number") serverClock = [now.server_ms, performance.now()];
  if (now.pid !== state.pid && now.pid) trace.length = 0;
  state = now.connection === "live" ? now : { ...state, ...now };
  if (now.connection === "live") {
    if (typeof now.t_s === "number") {
      if (!trace.length || now.t_s > trace.at(-1).t_s) trace.push(now);
      while (trace[0].t_s < now.t_s - TRACE_S) trace.shift();
    }
    drawKnobs(now.knobs);
    drawNumbers();
    drawTrace();
  }
  if (now.connection !== "live") {  // what was true before is not shown as what is
    for (const one of ["position", "velocity", "error", "voltage"]) by(one).textContent = "–";
    if (now.at_zero) by("voltage").textContent = "0.00";
    by("meter").style.width = "0";
  }
  drawState();
}

const source = new EventSource("events");
source.addEventListener("message", (event) => take(JSON.parse(event.data)));
source.addEventListener("error", () => take({ connection: "lost" }));
window.addEventListener("resize", drawTrace);

const viewer = document.body.dataset.viewer;
if (viewer) {
  by("viewer").src = viewer;
  by("viewer").hidden = false;
  document.body.classList.add("framed");
}
