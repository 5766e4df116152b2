// The last seconds as plots with axes: the band between least and greatest value of each bucket.

import { by } from "./asking.js";
import { markPlugin } from "./marks.js";
import { extremes, trace } from "./trace.js";

const SPAN_S = 20; // shown
const NEAR_LIMIT = 0.5; // of the voltage's limit: from there on the plot shows it
const [GRID, AXIS, TEXT] = ["#232b36", "#3a4655", "#a3afbd"];
const FONT = '11.5px system-ui, "Segoe UI", "DejaVu Sans", sans-serif';
const PLOTS = [
  { id: "position", title: "Position", unit: "rad", least: 0.02, lines: [["position_rad", "measured", "#8fa6bf", 3], ["reference_rad", "reference", "#62d868"]] },
  { id: "error", title: "Tracking error", unit: "mrad", least: 1, lines: [["error_mrad", "position − reference", "#f05050"]] },
  { id: "voltage", title: "Voltage", unit: "V", least: 0.5, lines: [["voltage_V", "applied", "#4696f5"]] },
  {
    id: "disturbance", title: "Disturbance", unit: "rad/s²", least: 1,
    lines: [["gravity_rad_s2", "gravity", "#5fbec8"], ["friction_rad_s2", "friction", "#c88ce1"], ["rest_rad_s2", "rest", "#e1cd5f"], ["disturbance_rad_s2", "estimate", "#ffa028"]],
  },
  { id: "lateness", title: "Lateness", unit: "µs", least: 50, lines: [["lateness_us", "sample after its instant", "#be5ac8"]] },
];

const plots = []; // of uPlot, with what they show
let limit = null; // V

const wide = (text) => String(text).replace("-", "−");
const faint = (colour) => `${colour}55`;

class Plot {
  constructor(what) {
    this.what = what;
    this.box = document.createElement("figure");
    this.box.id = `plot-${what.id}`;
    this.box.innerHTML = '<figcaption><b></b> <span class="unit"></span></figcaption><div class="canvas" role="img"></div>';
    const [caption, canvas] = this.box.children;
    caption.children[0].textContent = what.title;
    caption.children[1].textContent = what.unit;
    for (const [, label, colour] of what.lines) {
      const name = document.createElement("span");
      name.className = "line";
      name.textContent = label;
      name.style.setProperty("--line", colour);
      caption.append(name);
    }
    if (what.id === "voltage") caption.insertAdjacentHTML("beforeend", '<span class="limit"></span>');
    this.canvas = canvas;
    by("charts").append(this.box);
    this.plot = null;
  }

  make() {
    const series = this.what.lines.flatMap(([, label, colour, width = 1.25]) => [
      { label: `${label}, greatest`, stroke: colour, width, points: { show: false } },
      { label: `${label}, least`, stroke: colour, width, points: { show: false } },
    ]);
    const bands = this.what.lines.map(([, , colour], k) => ({ series: [2 * k + 1, 2 * k + 2], fill: faint(colour) }));
    const axis = { stroke: TEXT, font: FONT, grid: { stroke: GRID, width: 1 }, ticks: { stroke: AXIS, width: 1, size: 4 } };
    this.plot = new window.uPlot(
      {
        ...this.size(),
        legend: { show: false },
        cursor: { show: false },
        padding: [16, 12, 0, 0], // above: the labels of marks
        scales: { x: { time: false, range: () => this.span() }, y: { range: () => this.range() } },
        axes: [
          { ...axis, size: 24, gap: 3, space: 46, values: (_, ticks) => ticks.map((t) => `${wide(t)} s`) },
          { ...axis, size: 52, gap: 4, space: 17, values: (_, ticks) => ticks.map(wide) },
        ],
        series: [{}, ...series],
        bands,
        plugins: [markPlugin, { hooks: { draw: (plot) => this.drawMore(plot) } }],
      },
      this.data(),
      this.canvas,
    );
  }

  size() {
    return { width: Math.max(this.canvas.clientWidth, 80), height: Math.max(this.canvas.clientHeight, 60) };
  }

  span() {
    const end = trace.t.at(-1) ?? SPAN_S;
    return [Math.max(end - SPAN_S, Math.min(trace.t[0] ?? 0, end - 2)), end];
  }

  range() {
    const all = this.what.lines.map(([name]) => extremes(name)).filter(Boolean);
    let [low, high] = [Math.min(...all.map(([value]) => value)), Math.max(...all.map(([, value]) => value))];
    if (!all.length) [low, high] = [0, 0];
    if (this.what.id === "voltage" && limit) {
      if (high > NEAR_LIMIT * limit) high = Math.max(high, limit);
      if (low < -NEAR_LIMIT * limit) low = Math.min(low, -limit);
    }
    const spare = Math.max(0.08 * (high - low), (this.what.least - (high - low)) / 2);
    return [low - spare, high + spare];
  }

  data() {
    const pairs = this.what.lines.map(([name]) => trace.columns.get(name) ?? { low: [], high: [] });
    return [trace.t, ...pairs.flatMap(({ low, high }) => [high, low])];
  }

  // Limits of the voltage; late cycles as ticks at the foot of their plot.
  drawMore({ ctx, bbox, valToPos, scales }) {
    ctx.save();
    if (this.what.id === "voltage" && limit) {
      ctx.strokeStyle = "#f0505099";
      ctx.lineWidth = window.devicePixelRatio;
      ctx.setLineDash([6, 4]);
      for (const level of [-limit, limit].filter((one) => one >= scales.y.min && one <= scales.y.max)) {
        const y = valToPos(level, "y", true);
        ctx.beginPath();
        ctx.moveTo(bbox.left, y);
        ctx.lineTo(bbox.left + bbox.width, y);
        ctx.stroke();
      }
    }
    if (this.what.id === "lateness") {
      ctx.fillStyle = "#f05050";
      trace.t.forEach((t, k) => {
        if (trace.late[k]) ctx.fillRect(valToPos(t, "x", true) - 1, bbox.top + bbox.height - 8 * window.devicePixelRatio, 3, 8 * window.devicePixelRatio);
      });
    }
    ctx.restore();
  }

  draw() {
    if (!this.canvas.clientWidth) return; // the frame of a viewer is in its place
    if (!this.plot) this.make();
    const [{ width, height }, now] = [this.size(), this.plot];
    if (now.width !== width || now.height !== height) now.setSize({ width, height });
    now.setData(this.data());
  }

  // The plot in words, for those who do not see it.
  describe() {
    const said = this.what.lines.map(([name, label]) => {
      const found = extremes(name);
      return found ? `${label} from ${found[0].toPrecision(3)} to ${found[1].toPrecision(3)} ${this.what.unit}` : `${label}: no values`;
    });
    this.canvas.setAttribute("aria-label", `${this.what.title}, the last ${SPAN_S} seconds: ${said.join("; ")}`);
  }
}

export function setLimit(volts) {
  limit = volts;
  const name = by("charts").querySelector("#plot-voltage .limit");
  if (name) name.textContent = limit ? `limit ± ${limit} V` : "";
}

export function drawPlots() {
  if (!plots.length) plots.push(...PLOTS.map((what) => new Plot(what)));
  for (const plot of plots) plot.draw();
}

export function describePlots() {
  for (const plot of plots) plot.describe();
}

// The uPlot of a plot, as it is drawn.
export const plotOf = (id) => plots.find(({ what }) => what.id === id).plot;

// How many labels the axes of a plot show.
export const ticksOf = (id) => plotOf(id).axes.map(({ _values }) => (_values ?? []).filter((label) => label !== null && label !== "").length);

// What a plot shows on its upright axis.
export const rangeOf = (id) => [plotOf(id).scales.y.min, plotOf(id).scales.y.max];
