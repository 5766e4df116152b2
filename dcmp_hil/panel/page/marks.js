// Vertical marks in every plot: changes, and the end of the run.

const CHANGE = "#ffa028";
const [LABEL_CHARS_MAX, LABEL_ROWS] = [26, 3];
let marks = []; // [t in s, label, colour]

// "controller.kp_1_s2: 4000 -> 5200" without its table.
function short(words) {
  const text = words.replace(/(^|, )\w+\./g, "$1").replaceAll("->", "→");
  return text.length > LABEL_CHARS_MAX ? `${text.slice(0, LABEL_CHARS_MAX - 1)}…` : text;
}

export function setMarks(changes, end) {
  marks = changes.map(([t, words]) => [t, short(words), CHANGE]);
  if (end) marks.push([end.t, end.bad ? "trip" : "end", end.bad ? "#f05050" : "#8b98a8"]);
}

export const marksIn = (from, to) => marks.filter(([t]) => t >= from && t <= to);

// A plugin of uPlot that draws them.
export const markPlugin = {
  hooks: {
    draw: (plot) => {
      const { ctx, bbox } = plot;
      const scale = window.devicePixelRatio;
      ctx.save();
      const shown = marksIn(plot.scales.x.min, plot.scales.x.max);
      for (const [k, [t, label, colour]] of shown.entries()) {
        const x = Math.round(plot.valToPos(t, "x", true));
        ctx.strokeStyle = ctx.fillStyle = colour;
        ctx.lineWidth = 2 * scale;
        ctx.setLineDash(colour === CHANGE ? [4 * scale, 3 * scale] : []);
        ctx.beginPath();
        ctx.moveTo(x, bbox.top);
        ctx.lineTo(x, bbox.top + bbox.height);
        ctx.stroke();
        ctx.font = `600 ${11 * scale}px system-ui, sans-serif`;
        const wide = ctx.measureText(label).width;
        const right = x + wide + 5 * scale > bbox.left + bbox.width;
        ctx.textAlign = right ? "right" : "left";
        ctx.fillText(label, x + (right ? -4 : 4) * scale, bbox.top + (12 + 13 * (k % LABEL_ROWS)) * scale);
      }
      ctx.restore();
    },
  },
};
