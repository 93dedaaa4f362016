"use strict";
// The map of an instance with one plan: moves from starts to tasks, sites by workload and completion time; with zoom.

const MAX_LABELS = 40;
const above = "-sqrt(datum.size / PI) - 7"; // a label, over the circle of its task

// places in their own units, groups of agents, and moves that begin and end together
function layMap(map, plan) {
  const real = (place) => place && place.map((at, axis) => map.origin[axis] + map.unit * at);
  const tasks = map.task.id.map((id, j) => ({ id, work: map.task.work[j], place: real(map.task.place[j]), done: plan ? plan.done[j] : null,
    count: plan ? plan.count[j] : 0, ability: plan ? plan.ability[j] : 0, agents: [] }));
  const bases = map.base.name.map((name, b) => ({ name, place: real(map.base.place[b]), agents: [], idle: 0 }));
  const moves = new Map();
  map.agent.id.forEach((id, i) => {
    const [task, base] = [plan ? tasks[plan.of[i]] : undefined, bases[map.agent.base[i]]];
    if (task) task.agents.push(id);
    if (!base) return;
    base.agents.push(id);
    if (plan && plan.of[i] === -1) base.idle += 1;
    if (!task || !task.place) return;
    const key = `${map.agent.base[i]} ${plan.of[i]}`;
    if (!moves.has(key)) moves.set(key, { from: base, task, agents: [] });
    moves.get(key).agents.push(id);
  });
  return { tasks, bases: bases.filter((base) => base.place), moves: [...moves.values()] };
}

// the initial window: all places, with equal scales on both axes
function mapWindow(map, laid, width, height) {
  const places = [...laid.tasks, ...laid.bases].map((one) => one.place).filter(Boolean);
  const [xs, ys] = [0, 1].map((axis) => places.map((place) => place[axis]));
  const range = (values) => [values.reduce((a, b) => Math.min(a, b)), values.reduce((a, b) => Math.max(a, b))];
  const [[left, right], [bottom, upper]] = [range(xs), range(ys)];
  const unit = 1.12 * Math.max((right - left) / width, ((upper - bottom) * map.aspect) / height) || 1 / Math.min(width, height);
  const around = (low, high, half) => [(low + high) / 2 - half, (low + high) / 2 + half];
  return { x: around(left, right, (unit * width) / 2), y: around(bottom, upper, (unit * height) / (2 * map.aspect)) };
}

// names of agents, of which some may be unknown
function listed(names, count) {
  const shown = names.slice(0, 12);
  if (!shown.length) return counted(count, "agent");
  return shown.join(", ") + (count > shown.length ? ` and ${count - shown.length} more` : "");
}

const crowd = (count) => Math.min(1, 60 / count + 0.15); // marks are smaller where there are many

function mapSites(laid, plan) {
  const most = laid.tasks.reduce((so, task) => Math.max(so, task.work), 1e-12);
  const scale = 500 * Math.min(1, 40 / laid.tasks.length + 0.1);
  return laid.tasks.filter((task) => task.place).map((task) => ({ x: task.place[0], y: task.place[1], task: task.id, workload: task.work,
    size: 40 * crowd(laid.tasks.length) + (scale * task.work) / most, done: task.done, ability: task.ability,
    group: task.count ? listed(task.agents, task.count) : "nobody", open: Boolean(plan) && task.work > 0 && task.done === null }));
}

function mapSpec(map, laid, plan, width, height) {
  const domain = mapWindow(map, laid, width, height);
  const at = (field, axis) => ({ field, type: "quantitative", title: map.axes[axis === "x" ? 0 : 1],
    scale: { domain: domain[axis], nice: false, zero: false }, axis: { tickCount: 5, labelFlush: true } });
  const [time, paper, soft] = [map.units.time ? ` (${map.units.time})` : "", css("--paper"), css("--soft")];
  const moves = laid.moves.map((move) => ({ x: move.from.place[0], y: move.from.place[1], x2: move.task.place[0], y2: move.task.place[1],
    width: Math.min(0.8 + 0.5 * Math.sqrt(move.agents.length), 5), agents: listed(move.agents, move.agents.length), from: move.from.name, to: move.task.id }));
  const sites = mapSites(laid, plan);
  const starts = laid.bases.map((base) => ({ x: base.place[0], y: base.place[1], start: base.name, agents: listed(base.agents, base.agents.length),
    size: Math.min(28 + 8 * Math.sqrt(base.agents.length), 120) * crowd(laid.bases.length), idle: base.idle === base.agents.length && Boolean(plan) }));
  const tip = (...fields) => fields.map((field) => ({ field, type: "nominal", title: field === "done" ? `done at${time}` : field }));
  const [x, y] = [at("x", "x"), at("y", "y")];
  const served = sites.filter((site) => !site.open);
  const times = served.map((site) => site.done).filter((done) => done !== null);
  const isFlat = !times.length || Math.max(...times) - Math.min(...times) <= 1e-3 * Math.max(...times);
  const color = isFlat ? { value: isDark() ? "#8fb3d9" : "#4d6a8f" } : { field: "done", type: "quantitative",
    scale: { scheme: { name: "cividis", extent: isDark() ? [0.3, 1] : [0.12, 0.88] }, reverse: !isDark(), zero: false },
    legend: { title: `done at${time}`, orient: "bottom", gradientLength: Math.min(200, width / 2), titleColor: css("--ink"), titleOrient: "left", format: "~g" } };
  return { width, height, autosize: { type: "pad", contains: "content" }, layer: [
    { params: [{ name: "zoom", select: { type: "interval", encodings: ["x", "y"] }, bind: "scales" }],
      data: { values: moves }, mark: { type: "rule", clip: true, opacity: moves.length > 300 ? 0.3 : 0.6, color: soft },
      encoding: { x, y, x2: { field: "x2" }, y2: { field: "y2" }, strokeWidth: { field: "width", type: "quantitative", scale: null }, tooltip: tip("from", "to", "agents") } },
    { data: { values: starts }, mark: { type: "point", shape: "square", filled: true, clip: true, opacity: 1, stroke: soft, strokeWidth: starts.length > 200 ? 0.7 : 1.5 },
      encoding: { x, y, size: { field: "size", type: "quantitative", scale: null }, fill: { condition: { test: "datum.idle", value: paper }, value: soft }, tooltip: tip("start", "agents") } },
    { data: { values: served }, mark: { type: "point", shape: "circle", filled: true, clip: true, opacity: 1, stroke: paper, strokeWidth: 1 },
      encoding: { x, y, size: { field: "size", type: "quantitative", scale: null }, fill: color, tooltip: tip("task", "workload", "done", "ability", "group") } },
    { data: { values: sites.filter((site) => site.open) }, mark: { type: "point", filled: true, fill: paper, clip: true, opacity: 1, stroke: "#d55e00", strokeWidth: 2.5 },
      encoding: { x, y, size: { field: "size", type: "quantitative", scale: null }, tooltip: tip("task", "workload", "group") } },
    { data: { name: "labels", values: mapLabels(sites, domain, width, height) }, mark: { type: "text", dy: { expr: above }, clip: true, fontSize: 11, stroke: paper, strokeWidth: 3, strokeJoin: "round" },
      encoding: { x, y, text: { field: "task" } } },
    { data: { name: "labels" }, mark: { type: "text", dy: { expr: above }, clip: true, fontSize: 11, color: css("--ink") }, encoding: { x, y, text: { field: "task" } } }] };
}

// labels of the largest tasks that fit in a window without overlap
function mapLabels(sites, domain, width, height) {
  const taken = [];
  const pixel = (value, [low, high], size) => ((value - low) / (high - low)) * size;
  for (const site of [...sites].sort((a, b) => b.size - a.size)) {
    const [x, y, half] = [pixel(site.x, domain.x, width), pixel(site.y, domain.y, height), 3.2 * Math.min(site.task.length, 20) + 3];
    if (x < half || y < 0 || x > width - half || y > height - 18 || taken.length >= MAX_LABELS) continue;
    if (taken.some((one) => Math.abs(one.px - x) < one.half + half && Math.abs(one.py - y) < 15)) continue;
    const text = site.task.length > 20 ? `${site.task.slice(0, 19)}…` : site.task;
    taken.push({ x: site.x, y: site.y, size: site.size, task: text, px: x, py: y, half });
  }
  return taken;
}

// draws the map, and returns a function that zooms by a factor, or resets the window without one
async function drawMap(element, map, plan, width, height) {
  const laid = layMap(map, plan);
  const isPlaced = [...laid.tasks, ...laid.bases].some((one) => one.place);
  if (!isPlaced) return [laid, null];
  const spec = mapSpec(map, laid, plan, width, height);
  const { view } = await embed(element, spec);
  const whole = mapWindow(map, laid, width, height);
  const sites = mapSites(laid, plan);
  const relabel = () => {
    const domain = { x: view.scale("x").domain(), y: view.scale("y").domain() };
    view.data("labels", mapLabels(sites, domain, width, height)).run();
  };
  for (const axis of ["x", "y"]) view.addSignalListener(`zoom_${axis}`, () => { clearTimeout(drawMap.timer); drawMap.timer = setTimeout(relabel, 120); });
  const zoom = (factor) => {
    for (const axis of ["x", "y"]) {
      const [low, high] = view.scale(axis).domain();
      const half = ((high - low) / 2) * (factor || 1);
      view.signal(`zoom_${axis}`, factor ? [(low + high) / 2 - half, (low + high) / 2 + half] : whole[axis]);
    }
    return view.runAsync();
  };
  return [laid, zoom];
}
