"use strict";
// Charts of the runs under the same conditions: for each chart a title, a note, and a Vega-Lite specification.

const isDark = () => document.documentElement.classList.contains("dark");
const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
const DASHES = [[1, 0], [6, 3], [2, 2], [8, 3, 2, 3]];
const SHAPES = ["circle", "square", "triangle-up", "cross"];
const OUTCOMES = {
  solved: "#009e73", refused: "#999999", failed: "#d55e00", exited: "#cc79a7", killed: "#8c564b", hung: "#e69f00",
  "out of memory": "#0072b2", "missing package": "#56b4e9",
};

const ON_DARK = { "#000000": "#e8eaed", "#0072b2": "#2a8fd6" }; // what could hardly be seen there
function colourOf(page, method) {
  const colour = page.colours[method % page.colours.length];
  return (isDark() && ON_DARK[colour]) || colour;
}
const turnOf = (page, method, kinds) => kinds[Math.floor(method / page.colours.length) % kinds.length];

function config() {
  const [ink, soft, line] = [css("--ink"), css("--soft"), css("--line")];
  const axis = { labelColor: soft, titleColor: ink, gridColor: line, gridOpacity: 0.4, domainColor: line, tickColor: line,
    titleFontWeight: 500, titleFontSize: 12, labelFontSize: 11, labelLimit: 150, labelOverlap: "greedy", labelSeparation: 8 };
  const legend = { labelColor: ink, labelFontSize: 12, title: null, orient: "bottom", symbolStrokeWidth: 2.5, symbolOpacity: 1 };
  return { background: "transparent", font: "system-ui, sans-serif", view: { stroke: null }, axis, legend, text: { color: ink } };
}

// as many columns as fit with the longest name
function legendOf(names, width) {
  const longest = Math.min(Math.max(...names.map((name) => 7.2 * name.length), 40), 230);
  return { columns: Math.max(1, Math.floor((width - 70) / (longest + 34))), labelLimit: longest };
}
// a name for each row of a bar chart
const rowNames = (width) => ({ labelOverlap: false, labelLimit: Math.min(230, width * 0.35) });

// colours and dashes of the methods that are shown, the same in all charts
function byMethod(page, methods, width, more = {}) {
  const domain = methods.map((method) => page.labels[method]);
  const legend = { ...legendOf(domain, width), ...more };
  const scale = { domain, range: methods.map((method) => colourOf(page, method)) };
  const other = (range) => ({ field: "method", type: "nominal", scale: { domain, range: methods.map((one) => turnOf(page, one, range)) }, legend });
  return { color: { field: "method", type: "nominal", scale, legend }, strokeDash: other(DASHES), shape: other(SHAPES) };
}

const flat = (page, entries, row) =>
  entries.flatMap((entry) => entry.x.map((x, i) => ({ method: page.labels[entry.method], x, ...row(entry, i) })));
const quantitative = (field, title, more = {}) => ({ field, type: "quantitative", title, ...more });
const percent = (digits) => ({ format: `.${digits}~%` });
const highest = (values, share) => {
  const known = values.filter((value) => value !== null).sort((a, b) => a - b);
  return known[Math.min(known.length - 1, Math.floor(share * known.length))];
};
const seconds = { scale: { type: "log", nice: false }, axis: { format: "~g", tickCount: 6 } };
const horizontal = (count) => count * (count > 12 ? 18 : 26);

function profiles(page, group, methods, width) {
  const entries = group.series.profiles.filter((one) => methods.includes(one.method));
  if (!entries.length) return "There is nothing to draw: profiles need two methods with results on the same instances.";
  const { color, strokeDash } = byMethod(page, methods, width);
  return { data: { values: flat(page, entries, (entry, i) => ({ y: entry.y[i] })) },
    mark: { type: "line", interpolate: "step-after", strokeWidth: 2, tooltip: true },
    encoding: { x: quantitative("x", "T over the best method's", { scale: { zero: false, nice: false } }),
      y: quantitative("y", "share of instances", { scale: { domain: [0, 1] }, axis: percent(0) }), color, strokeDash } };
}

function targets(page, group, methods, width) {
  const entries = group.series.time.filter((one) => methods.includes(one.method));
  if (!entries.length) return "There is nothing to draw: no run has a trace.";
  const { color, strokeDash } = byMethod(page, methods, width);
  return { data: { values: flat(page, entries, (entry, i) => ({ y: entry.y[i] })) },
    mark: { type: "line", interpolate: "step-after", strokeWidth: 2, tooltip: true },
    encoding: { x: quantitative("x", "time (s)", seconds),
      y: quantitative("y", "share of targets", { scale: { domain: [0, 1] }, axis: percent(0) }), color, strokeDash } };
}

function distance(page, group, methods, width) {
  const entries = group.series.time.filter((one) => methods.includes(one.method) && one.middle.some((y) => y !== null));
  if (!entries.length) return "There is nothing to draw: no run has a trace with a makespan.";
  const { color, strokeDash } = byMethod(page, methods, width, { symbolType: "stroke" });
  const values = flat(page, entries, (entry, i) => ({ low: entry.low[i], middle: entry.middle[i], high: entry.high[i] }))
    .filter((row) => row.middle !== null);
  const most = Math.max(highest(values.map((row) => row.high), 0.98) || 0, 0.01);
  const y = { scale: { type: "sqrt", domain: [0, most], clamp: true }, axis: { ...percent(1), tickCount: 6 } };
  const x = quantitative("x", "time (s)", seconds);
  return { data: { values }, layer: [
    { mark: { type: "area", interpolate: "step-after", opacity: 0.15 },
      encoding: { x, y: quantitative("low", "T above the best known", y), y2: { field: "high" }, color } },
    { mark: { type: "line", interpolate: "step-after", strokeWidth: 2, tooltip: true },
      encoding: { x, y: quantitative("middle", "T above the best known", y), color, strokeDash } }] };
}

function tradeoff(page, group, methods, width) {
  const entries = group.series.tradeoff.filter((one) => methods.includes(one.method));
  if (!entries.length) return "There is nothing to draw: no method has both a makespan and an energy above 0.";
  const { color, shape } = byMethod(page, methods, width);
  const values = flat(page, entries, (entry, i) => ({ x: entry.x[i] - 1, y: entry.y[i] - 1, instance: page.instances.name[entry.instance[i]] }));
  const medians = entries.map((one) => ({ method: page.labels[one.method], x: one.x_median - 1, y: one.y_median - 1 }));
  const scale = (name) => ({ type: "sqrt", domain: [0, Math.max(highest(values.map((row) => row[name]), 0.98), 0.01) * 1.05], clamp: true });
  const x = quantitative("x", "T above the least", { scale: scale("x"), axis: { ...percent(1), tickCount: 6 } });
  const y = quantitative("y", "energy above the least", { scale: scale("y"), axis: { ...percent(1), tickCount: 6 } });
  const tooltip = [{ field: "instance", type: "nominal" }, { field: "method", type: "nominal" },
    { field: "x", type: "quantitative", format: ".2%", title: "T above" }, { field: "y", type: "quantitative", format: ".2%", title: "energy above" }];
  return { layer: [
    { data: { values }, mark: { type: "point", filled: true, size: 28, opacity: 0.45 }, encoding: { x, y, color, shape, tooltip } },
    { data: { values: medians }, mark: { type: "point", shape: "diamond", filled: true, size: 190, stroke: css("--paper"), strokeWidth: 1.5, opacity: 1 },
      encoding: { x, y, color, tooltip: tooltip.slice(1) } }] };
}

function thinned(group, methods) {
  const entries = group.series.tradeoff.filter((one) => methods.includes(one.method));
  const [drawn, all] = [(one) => one.x.length, (one) => one.points].map((get) => entries.reduce((sum, one) => sum + get(one), 0));
  return drawn < all ? `${drawn.toLocaleString("en")} of ${counted(all, "point")} are drawn.` : "";
}

const MEASURES = { runtime_s: "time (s)", gap: "gap to the best bound", ratio: "T over the best method's", memory_mb: "memory (MiB)" };
function scaling(page, group, methods, width, measure) {
  const values = group.series.scaling.filter((one) => one.measure === measure && methods.includes(one.method))
    .map((one) => ({ ...one, method: page.labels[one.method] })).filter((one) => measure === "gap" || measure === "ratio" || one.high > 0);
  if (!values.length) return `There is nothing to draw: no method has a figure for ${MEASURES[measure]}.`;
  const { color, strokeDash } = byMethod(page, methods, width, { symbolType: "stroke" });
  const isLog = measure === "runtime_s" || measure === "memory_mb";
  const sizes = new Set(values.map((one) => one.agents));
  const x = quantitative("agents", "agents", { scale: { type: "log", padding: 12, nice: sizes.size < 2 }, axis: { format: "~s", tickCount: 6 } });
  const y = { title: MEASURES[measure], scale: isLog ? { type: "log", clamp: true } : { zero: false },
    axis: { tickCount: 6, format: measure === "gap" ? ".2~%" : "~g" } };
  if (isLog) values.forEach((one) => { one.low = Math.max(one.low, one.high * 1e-4); one.middle = Math.max(one.middle, one.low); });
  const tooltip = ["method", "agents", "instances", "low", "middle", "high"].map((field) =>
    ({ field, type: field === "method" ? "nominal" : "quantitative", format: field === "method" ? undefined : ".4~g" }));
  return { data: { values }, layer: [
    { mark: { type: "rule", opacity: 0.5 }, encoding: { x, y: { ...quantitative("low", y.title), ...y }, y2: { field: "high" }, color } },
    { mark: { type: "line" }, encoding: { x, y: { ...quantitative("middle", y.title), ...y }, color, strokeDash } },
    { mark: { type: "point", filled: true, size: 45, opacity: 1 }, encoding: { x, y: { ...quantitative("middle", y.title), ...y }, color, tooltip } }] };
}

function gaps(page, group, methods, width) {
  const values = group.series.gaps.filter((one) => methods.includes(one.method)).map((one) => ({ ...one, method: page.labels[one.method], bounds: `${one.instances} of ${one.of}` }));
  if (!values.length) return "There is nothing to draw: no run proved a bound on the makespan of an instance that was served.";
  const sort = methods.map((method) => page.labels[method]);
  const y = { field: "method", type: "nominal", title: null, sort, axis: rowNames(width) };
  const scale = { domain: sort, range: methods.map((method) => colourOf(page, method)) };
  const color = { field: "method", type: "nominal", scale, legend: null };
  const x = (field) => quantitative(field, "gap to the best bound", { axis: { ...percent(2), tickCount: 6 } });
  const tooltip = [{ field: "method", type: "nominal" }, { field: "bounds", type: "nominal", title: "instances" },
    ...["least", "low", "middle", "high", "most"].map((field, i) => ({ field, type: "quantitative", format: ".3%", title: ["5 %", "25 %", "median", "75 %", "95 %"][i] }))];
  return { data: { values }, height: horizontal(values.length), layer: [
    { mark: { type: "rule" }, encoding: { y, x: x("least"), x2: { field: "most" }, color, tooltip } },
    { mark: { type: "bar", size: 12, opacity: 0.75 }, encoding: { y, x: x("low"), x2: { field: "high" }, color, tooltip } },
    { mark: { type: "tick", color: css("--ink"), thickness: 2.5, size: 18 }, encoding: { y, x: x("middle"), tooltip } }] };
}

function outcomes(page, group, methods, width) {
  const values = group.methods.filter((one) => methods.includes(one.method)).flatMap((one) => Object.entries(one.outcomes)
    .map(([outcome, runs]) => ({ method: page.labels[one.method], outcome, runs })));
  if (!values.length) return "There is nothing to draw: no method is selected.";
  const domain = Object.keys(OUTCOMES).filter((outcome) => values.some((one) => one.outcome === outcome));
  const range = domain.map((outcome) => OUTCOMES[outcome]);
  return { data: { values }, height: horizontal(methods.length), mark: { type: "bar", tooltip: true }, encoding: {
    y: { field: "method", type: "nominal", title: null, sort: methods.map((method) => page.labels[method]), axis: rowNames(width) },
    x: quantitative("runs", "share of runs", { stack: "normalize", axis: { format: ".0%" } }),
    color: { field: "outcome", type: "nominal", scale: { domain, range }, legend: legendOf(domain, 0.62 * width) },
    tooltip: ["method", "outcome", "runs"].map((field) => ({ field, type: "nominal" })) } };
}

function differences(page, rows, width) {
  const values = rows.map((one) => ({ ...one, method: page.labels[one.method] }));
  const scale = { domain: values.map((one) => one.method), range: rows.map((one) => colourOf(page, one.method)) };
  const y = { field: "method", type: "nominal", title: null, sort: null, axis: rowNames(width) };
  const color = { field: "method", type: "nominal", scale, legend: null };
  const x = (field) => quantitative(field, `difference of ${rows[0].score === "makespan" ? "T" : "energy"}, with 95 % interval`,
    { axis: { format: "+.2~%", tickCount: 6 } });
  return { data: { values }, height: horizontal(values.length), layer: [
    { data: { values: [{}] }, mark: { type: "rule", color: css("--soft"), strokeDash: [4, 4] }, encoding: { x: { datum: 0, type: "quantitative" } } },
    { mark: { type: "rule", strokeWidth: 2.5 }, encoding: { y, x: x("low"), x2: { field: "high" }, color } },
    { mark: { type: "point", filled: true, size: 80, opacity: 1 }, encoding: { y, x: x("mean"), color,
      tooltip: [{ field: "method", type: "nominal" }, ...["mean", "low", "high"].map((field) => ({ field, type: "quantitative", format: "+.3%" }))] } }] };
}

const CHARTS = [
  { id: "profiles", title: "Performance profiles", draw: profiles,
    note: "Share of the instances on which T is at most this factor of the best method's. Higher is better." },
  { id: "targets", title: "Targets reached over time", draw: targets,
    note: "A target is the best known T of an instance, or 1 % or 5 % more. Share of all targets that runs have reached by then." },
  { id: "distance", title: "Convergence", draw: distance,
    note: "T found so far, above the best known of the instance: median over runs, with the interquartile range as a band." },
  { id: "tradeoff", title: "Makespan against energy", draw: tradeoff, more: thinned,
    note: "Each point is a method on an instance, above the least of any method there; diamonds are medians. The furthest 2 % are drawn at the edge." },
  { id: "scaling", title: "Scaling", draw: scaling, measures: MEASURES,
    note: "Over the number of agents: median and interquartile range over instances." },
  { id: "gaps", title: "Gap to the best bound", draw: gaps,
    note: "To the best bound that any run proved on the instance: median, interquartile range (bar), and 5 % to 95 % (line)." },
  { id: "outcomes", title: "How runs ended", draw: outcomes, note: "Only solved runs have scores." },
];
