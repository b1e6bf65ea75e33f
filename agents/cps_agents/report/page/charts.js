// Charts: the episodes of a pair as dots, and learning curves.

const DOTS = { height: 92, left: 16, right: 16 };
const CHART = { height: 260, left: 52, right: 16, top: 14, bottom: 36 };

/** Pixels that a chart may take, so that its letters are as large on a phone as elsewhere. */
function room() {
  return clamp(document.getElementById("main").clientWidth - 40, 280, 640);
}

/** A dot for each episode, the mean and its interval below. `watchable`: seeds that can be played. */
function makeDots(found, unit, watchable, watch) {
  const { height, left, right } = DOTS;
  const width = room();
  const ends = [...found.values, found.low ?? found.mean, found.high ?? found.mean];
  const [low, high] = widened(Math.min(...ends), Math.max(...ends));
  const x = (value) => left + ((value - low) / (high - low)) * (width - left - right);
  const svg = make("svg:svg", { viewBox: `0 0 ${width} ${height}`, class: "chart", role: "img",
    "aria-label": `${found.values.length} episodes, mean ${number(found.mean)}` });
  for (const mark of ticks(low, high, width / 100)) {
    svg.append(make("svg:line", { x1: x(mark), x2: x(mark), y1: 6, y2: height - 22, class: "grid" }),
      make("svg:text", { x: x(mark), y: height - 6, "text-anchor": "middle" }, number(mark)));
  }
  const stacked = new Map();
  found.values.forEach((value, seed) => {
    const column = Math.round(x(value) / 7);
    const level = stacked.get(column) ?? 0;
    stacked.set(column, level + 1);
    const playable = watchable.includes(seed);
    svg.append(make("svg:circle", {
      cx: x(value), cy: 44 - Math.min(level, 5) * 7, r: playable ? 5 : 3.2, class: playable ? "dot playable" : "dot",
      onclick: playable ? () => watch(seed) : null,
    }, make("svg:title", {}, `Seed ${seed}: ${number(value, 4)} ${unit}`)));
  });
  const y = 58;
  if (found.low !== null) svg.append(make("svg:line", { x1: x(found.low), x2: x(found.high), y1: y, y2: y, class: "whisker" }));
  svg.append(make("svg:path", { d: `M${x(found.mean)} ${y - 6}l6 6l-6 6l-6 -6z`, class: "mean" },
    make("svg:title", {}, `Mean ${number(found.mean, 4)}`)));
  return svg;
}

function widened(low, high) {
  const margin = (high - low) * 0.04 || Math.abs(high) * 0.1 || 1;
  return [low - margin, high + margin];
}

/** Curves {name, seed, steps, scores} over decisions; the seeds of a run share their line. */
function makeCurves(curves) {
  const { height, left, right, top, bottom } = CHART;
  const width = room();
  const most = Math.max(...curves.flatMap((curve) => curve.steps), 1);
  const scores = curves.flatMap((curve) => curve.scores);
  const [low, high] = widened(Math.min(...scores), Math.max(...scores));
  const x = (steps) => left + (steps / most) * (width - left - right);
  const y = (score) => height - bottom - ((score - low) / (high - low)) * (height - top - bottom);
  const svg = make("svg:svg", { viewBox: `0 0 ${width} ${height}`, class: "chart", role: "img",
    "aria-label": `${curves.length} learning curves` });
  for (const mark of ticks(low, high)) {
    svg.append(make("svg:line", { x1: left, x2: width - right, y1: y(mark), y2: y(mark), class: "grid" }),
      make("svg:text", { x: left - 6, y: y(mark) + 4, "text-anchor": "end" }, number(mark)));
  }
  for (const mark of ticks(0, most, width / 120)) {
    svg.append(make("svg:text", { x: x(mark), y: height - 18, "text-anchor": "middle" }, number(mark, 4)));
  }
  svg.append(make("svg:text", { x: (left + width - right) / 2, y: height - 2, "text-anchor": "middle" }, "decisions"));
  const runs = [...new Set(curves.map((curve) => curve.run))];
  for (const curve of curves) {
    const style = LINES[runs.indexOf(curve.run) % LINES.length];
    const points = curve.steps.map((steps, k) => `${x(steps).toFixed(1)},${y(curve.scores[k]).toFixed(1)}`).join(" ");
    svg.append(make("svg:polyline", { points, class: "curve", style: `stroke:var(${style.color})`,
      "stroke-dasharray": style.dash.join(" ") || null },
    make("svg:title", {}, `${curve.run}, ${curve.seed}: best ${number(curve.best, 4)}`)));
  }
  const legend = make("ul", { class: "legend" }, runs.map((run, k) => make("li", {}, sample(LINES[k % LINES.length]), run)));
  return make("figure", {}, svg, legend);
}

function sample(style) {
  return make("svg:svg", { viewBox: "0 0 30 8", width: 30, height: 8, "aria-hidden": true },
    make("svg:line", { x1: 0, x2: 30, y1: 4, y2: 4, class: "curve", style: `stroke:var(${style.color})`,
      "stroke-dasharray": style.dash.join(" ") || null }));
}
