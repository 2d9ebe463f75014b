"use strict";
// Charts with uPlot: the legend shows the values at the pointer; drag to zoom, double-click to reset.

const CHART_HEIGHT = 230;
const INK = "#1d2733";
const GRID = { stroke: "#e3e8ee", width: 1 };
const FONT = "12px system-ui, sans-serif";

async function drawFigure(place) {
  const charts = page.figures[Number(place.dataset.figure)];
  for (const chart of charts) {
    const box = element("div", { className: chart.upright ? "chart upright" : chart.wide || charts.length === 1 ? "chart wide" : "chart" });
    const level = chart.upright ? `${chart.x.label} over ${chart.y.label}` : chart.y.label;
    const what = chart.title && chart.title !== level ? `${chart.title}: ${level}` : level;
    box.append(element("h4", {}, element("span", {}, what), element("span", {}, chart.right)));
    place.append(box);
    await drawChart(box, chart);
  }
}

async function drawChart(box, chart) {
  const lines = await Promise.all(chart.series.map(async (one) => [await array(one.x), await array(one.y)]));
  const data = aligned(lines, chart);
  const width = () => Math.max(box.clientWidth || shownWidth(box), 240);
  const options = {
    width: width(),
    height: chart.upright ? 360 : CHART_HEIGHT,
    padding: [10, chart.right ? 4 : 22, 0, 0],
    scales: {
      x: { time: false, distr: chart.x.log ? 3 : 1, ori: chart.upright ? 1 : 0, range: rangeOf(chart.x) },
      y: { distr: chart.y.log ? 3 : 1, ori: chart.upright ? 0 : 1, range: rangeOf(chart.y) },
      right: { distr: 1 },
    },
    axes: axesOf(chart),
    series: [
      { label: chart.x.label, value: (_, value) => nameOf(chart.x, value) },
      ...chart.series.map((one, index) => seriesOf(one, lines[index])),
    ],
    legend: { live: true },
    cursor: { drag: { x: true, y: false }, points: { size: 7 } },
  };
  const drawn = new uPlot(options, data, box);
  new ResizeObserver(() => {
    if (box.clientWidth && Math.abs(box.clientWidth - drawn.width) > 1) drawn.setSize({ width: width(), height: drawn.height });
  }).observe(box);
}

/** Return the width of the nearest visible ancestor of a hidden chart. */
function shownWidth(box) {
  let parent = box;
  while (parent && !parent.clientWidth) parent = parent.parentElement;
  return (parent ? parent.clientWidth : 800) - 60;
}

/** Join the lines over a common x, as uPlot requires. */
function aligned(lines, chart) {
  const tables = lines.map(([x, y]) => [Array.from(x), Array.from(y, (value) => gap(value, chart.y.log))]);
  const first = lines[0][0];
  if (lines.every(([x]) => x === first)) return [tables[0][0], ...tables.map(([, y]) => y)];
  return uPlot.join(tables);
}

function gap(value, log) {
  return Number.isNaN(value) || (log && value <= 0) ? null : value;
}

function seriesOf(one, [x]) {
  const names = new Map(one.labels.map((label, index) => [x[index], label]));
  return {
    label: one.name,
    stroke: one.colour,
    fill: one.fill ? one.colour + "30" : undefined,
    width: one.line ? 1.8 : 0,
    dash: one.dash,
    spanGaps: true,
    scale: one.right ? "right" : "y",
    paths: one.line ? (one.step ? uPlot.paths.stepped({ align: 1 }) : undefined) : () => null,
    points: { show: one.marks, size: 6, fill: one.colour, stroke: one.colour },
    value: (plot, value, _, index) => {
      const name = index === null || value === null ? undefined : names.get(plot.data[0][index]);
      return shortNumber(value) + (name === undefined ? "" : ` (${name})`);
    },
  };
}

function axesOf(chart) {
  const shared = { stroke: INK, grid: GRID, ticks: GRID, font: FONT, labelFont: FONT, labelSize: 20, labelGap: 2 };
  const ticks = (axis) => (_, values) => values.map((value) => (value === null ? "" : nameOf(axis, value)));
  const named = chart.x.names.length ? { splits: () => chart.x.names.map((_, k) => k), rotate: -90, size: 60 } : {};
  const x = { ...shared, size: 30, label: chart.x.label, values: ticks(chart.x), ...named };
  const y = { ...shared, values: ticks(chart.y), size: sizeOfTicks };
  if (chart.upright) return [{ ...x, side: 3, size: sizeOfTicks, label: undefined }, { ...y, side: 2, size: 26, label: chart.y.label }];
  if (!chart.right) return [x, y];
  return [x, y, { ...shared, scale: "right", side: 1, values: ticks(chart.y), grid: { show: false }, size: sizeOfTicks }];
}

/** Return the width of the tick labels of a vertical axis. */
function sizeOfTicks(plot, values, axis, cycle) {
  if (cycle > 1) return plot.axes[axis]._size;
  return 20 + 7 * Math.max(3, ...(values || []).map((text) => String(text).length));
}

function nameOf(axis, value) {
  if (!axis.names.length) return shortNumber(value);
  return axis.names[value] === undefined ? "" : axis.names[value];
}

/** Return the range of a categorical axis with a margin on both sides; undefined for other axes. */
function rangeOf(axis) {
  return axis.names.length ? [-0.6, axis.names.length - 0.4] : undefined;
}
