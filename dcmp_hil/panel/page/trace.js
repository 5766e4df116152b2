// The last seconds of a run: least and greatest value of every column in each bucket, so that every cycle counts.

const SPAN_S = 20; // kept

// Columns by name, each with the arrays `low` and `high`; `t`, s, and `late`, cycles, of each bucket.
export const trace = { t: [], late: [], columns: new Map(), changed: false };

export function clear() {
  trace.t.length = trace.late.length = 0;
  for (const { low, high } of trace.columns.values()) low.length = high.length = 0;
  trace.changed = true;
}

export function add(names, buckets) {
  for (const bucket of buckets) {
    const [t, late, ...values] = bucket;
    if (trace.t.length && t <= trace.t.at(-1)) clear(); // another run
    trace.t.push(t);
    trace.late.push(late);
    names.forEach((name, k) => {
      if (!trace.columns.has(name)) trace.columns.set(name, { low: [], high: [] });
      const column = trace.columns.get(name);
      column.low.push(values[2 * k]);
      column.high.push(values[2 * k + 1]);
    });
  }
  forget();
  if (buckets.length) trace.changed = true;
}

function forget() {
  const first = trace.t.findIndex((t) => t >= trace.t.at(-1) - SPAN_S);
  if (first <= 0) return;
  for (const array of [trace.t, trace.late, ...[...trace.columns.values()].flatMap(({ low, high }) => [low, high])]) array.splice(0, first);
}

// Least and greatest value of a column over all that is kept; null where there is none.
export function extremes(name) {
  const { low, high } = trace.columns.get(name) ?? { low: [], high: [] };
  const [lows, highs] = [low.filter(Number.isFinite), high.filter(Number.isFinite)];
  return lows.length ? [Math.min(...lows), Math.max(...highs)] : null;
}
