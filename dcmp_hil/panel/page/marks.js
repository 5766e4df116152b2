// Vertical marks in every plot: changes, and the end of the run.

const CHANGE = "#ffa028";
const LABEL_CHARS_MAX = 26;
let marks = []; // [t in s, label, colour]

// "controller.kp_1_s2: 4000 -> 5200" without its table.
function short(words) {
  const text = words.replace(/(^|, )\w+\./g, "$1").replaceAll("->", "→");
  return text.length > LABEL_CHARS_MAX ? `${text.slice(0, LABEL_CHARS_MAX - 1)}…` : text;
}

export function setMarks(changes, end) {
  marks = changes.map(([t, words]) => [t, short(words), CHANGE]);
  if (end) marks.push([end.t, end.trip ? "trip" : "end", end.bad ? "#f05050" : "#8b98a8"]);
}

export const marksIn = (from, to) => marks.filter(([t]) => t >= from && t <= to);

// A plugin of uPlot that draws them: a line through the plot, and its label in the margin above, where no data are.
// Of labels that would overlap, the newest is shown.
export const markPlugin = {
  hooks: {
    draw: (plot) => {
      const { ctx, bbox } = plot;
      const scale = window.devicePixelRatio;
      let free = bbox.left + bbox.width; // where the label to the right begins
      ctx.save();
      ctx.font = `600 ${11 * scale}px system-ui, sans-serif`;
      [ctx.textAlign, ctx.textBaseline, ctx.lineWidth] = ["left", "alphabetic", 2 * scale];
      for (const [t, label, colour] of marksIn(plot.scales.x.min, plot.scales.x.max).reverse()) {
        const x = Math.round(plot.valToPos(t, "x", true));
        ctx.strokeStyle = ctx.fillStyle = colour;
        ctx.setLineDash(colour === CHANGE ? [4 * scale, 3 * scale] : []);
        ctx.beginPath();
        ctx.moveTo(x, bbox.top - 13 * scale);
        ctx.lineTo(x, bbox.top + bbox.height);
        ctx.stroke();
        const wide = ctx.measureText(label).width + 8 * scale;
        const left = x + wide <= free ? x : Math.max(bbox.left - 40 * scale, x - wide);
        if (left + wide > free) continue;
        ctx.fillText(label, left + 4 * scale, bbox.top - 4 * scale);
        free = Math.min(left, x);
      }
      ctx.restore();
    },
  },
};
