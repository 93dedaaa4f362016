"use strict";
const plan = JSON.parse(document.getElementById("plan").textContent);
const byId = (name) => document.getElementById(name);
const svg = byId("map");
const chosen = new Set(plan.tasks.keys());
let view = { x: 0, y: 0, k: 1 };
let wanted = "";

function element(parent, name, attributes, text) {
  const space = parent.namespaceURI;
  const made = parent.appendChild(document.createElementNS(space, name));
  for (const [key, value] of Object.entries(attributes || {})) made.setAttribute(key, value);
  if (text !== undefined) made.textContent = text;
  return made;
}

const dot = ([x, y]) => `M${x},${y}h0`;
const mix = (share) => {
  const [early, late] = [[226, 202, 102], [32, 60, 104]];
  return `rgb(${early.map((part, i) => Math.round(part + share * (late[i] - part))).join()})`;
};
const lines = (headings, cells) => headings.map((name, i) => `${name}: ${cells[i]}`).join("\n");
const listed = (names) => names.slice(0, 12).join(", ") + (names.length > 12 ? ` and ${names.length - 12} more` : "");
const agentsOf = plan.tasks.map(() => []);
const startsAt = plan.bases.map(() => []);
const returnsTo = plan.bases.map(() => []);
plan.agents.forEach((agent) => {
  if (agent.task >= 0 && !agent.violation) agentsOf[agent.task].push(agent);
  if (agent.base >= 0) startsAt[agent.base].push(agent);
  if (agent.home >= 0) returnsTo[agent.home].push(agent);
});

// what is drawn once; zooming moves the group, and strokes keep their width
const moves = new Map();
for (const agent of plan.agents) {
  const [base, task] = [plan.bases[agent.base], plan.tasks[agent.task]];
  if (agent.violation || !base || !task || !task.place || base.task === agent.task) continue;
  const key = `${agent.base} ${agent.task}`;
  if (!moves.has(key)) moves.set(key, { base, task: agent.task, agents: [] });
  moves.get(key).agents.push(agent);
}
for (const move of moves.values()) {
  const width = Math.min(1 + Math.sqrt(move.agents.length), 8);
  const [from, to] = [move.base.place, plan.tasks[move.task].place];
  move.path = element(byId("moves"), "path", { d: `M${from}L${to}`, "stroke-width": width });
  move.path.onpointerenter = (event) => {
    const only = move.agents.length === 1;
    const names = listed(move.agents.map((agent) => agent.id));
    show(event, only ? lines(plan.agentHeadings, move.agents[0].cells)
      : `${move.base.name} to ${plan.tasks[move.task].id}\n${move.agents.length} agents: ${names}`);
  };
  move.path.onpointerleave = hide;
}
const returns = new Map();
for (const agent of plan.agents) {
  const [home, task] = [plan.bases[agent.home], plan.tasks[agent.task]];
  if (agent.violation || !home || !task || !task.place || agent.home === agent.base || home.task === agent.task) continue;
  const key = `${agent.task} ${agent.home}`;
  if (!returns.has(key)) returns.set(key, { path: element(byId("returns"), "path", { d: `M${task.place}L${home.place}` }), agents: [] });
  returns.get(key).agents.push(agent);
}
plan.bases.forEach((base, b) => {
  if (base.task !== null) return;
  const group = element(byId("starts"), "g");
  const size = Math.min(9 + 2 * Math.sqrt(startsAt[b].length), 20);
  const square = { d: dot(base.place), style: startsAt[b].length ? "stroke-linecap: square" : "" };
  element(group, "path", { ...square, "stroke-width": size + 3, class: "ring" });
  element(group, "path", { ...square, "stroke-width": size, class: "start" });
  base.inner = element(group, "path", { ...square, "stroke-width": size - 5, class: "hole" });
  base.group = group;
  group.onpointerenter = (event) => {
    const only = startsAt[b].length === 1;
    const back = returnsTo[b].length ? `\n${returnsTo[b].length} return here\n${listed(returnsTo[b].map((agent) => agent.id))}` : "";
    show(event, only && !back ? lines(plan.agentHeadings, startsAt[b][0].cells)
      : `${base.name}: ${startsAt[b].length} begin here\n${listed(startsAt[b].map((agent) => agent.id))}${back}`);
  };
  group.onpointerleave = hide;
});
const order = [...plan.tasks.keys()].sort((one, other) => plan.tasks[other].size - plan.tasks[one].size);
for (const j of order) {
  const task = plan.tasks[j];
  if (!task.place) continue;
  const group = element(byId("sites"), "g", { style: "cursor: pointer" });
  const size = 9 + 25 * task.size * Math.min(1, Math.sqrt(40 / plan.tasks.length));
  const colour = task.unserved ? "#d55e00" : mix(task.late === null ? 0.75 : task.late);
  element(group, "path", { d: dot(task.place), "stroke-width": size + 3, class: "ring" });
  element(group, "path", { d: dot(task.place), "stroke-width": size, stroke: colour });
  if (task.unserved) element(group, "path", { d: dot(task.place), "stroke-width": size - 5, class: "hole" });
  Object.assign(task, { group, radius: size / 2 });
  group.onpointerenter = (event) => show(event, `${lines(plan.taskHeadings, task.cells)}\n${
    task.unserved ? "unserved" : listed(agentsOf[j].map((agent) => agent.id))}`);
  group.onpointerleave = hide;
  group.onclick = () => choose(chosen.size === 1 && chosen.has(j) ? plan.tasks.keys() : [j]);
}

function show(event, text) {
  const box = byId("hover");
  box.textContent = text;
  box.hidden = false;
  const { left, top, width, height } = svg.getBoundingClientRect();
  box.style.left = `${Math.min(event.clientX - left + 14, width - box.offsetWidth - 4)}px`;
  box.style.top = `${Math.min(event.clientY - top + 14, height - box.offsetHeight - 4)}px`;
}
function hide() { byId("hover").hidden = true; }

// filters
const heads = element(element(byId("agents").tHead, "tr"), "th", {}, plan.agentHeadings[0]).parentNode;
plan.agentHeadings.slice(1).forEach((name) => element(heads, "th", {}, name));
const boxes = plan.tasks.map((task, j) => {
  const label = element(element(byId("tasks"), "li"), "label");
  const box = element(label, "input", { type: "checkbox" });
  element(label, "b", {}, task.id);
  const finish = task.cells[plan.taskHeadings.findIndex((name) => name.startsWith("finish"))];
  element(label, "span", task.unserved ? { class: "late" } : {},
    task.unserved ? "unserved" : `${agentsOf[j].length} agent${agentsOf[j].length === 1 ? "" : "s"}, done at ${finish}`);
  box.onchange = () => { chosen[box.checked ? "add" : "delete"](j); filter(); };
  return box;
});
function choose(tasks) {
  const next = [...tasks];
  chosen.clear();
  next.forEach((j) => chosen.add(j));
  filter();
}
const matches = (text) => text.toLowerCase().includes(wanted);
function isShown(agent) {
  const task = plan.tasks[agent.task];
  if (wanted && !matches(agent.id) && !(task && matches(task.id))) return false;
  return task ? chosen.has(agent.task) : byId("idle").checked;
}
function filter() {
  const shown = new Set(plan.agents.filter(isShown));
  boxes.forEach((box, j) => {
    box.checked = chosen.has(j);
    const found = !wanted || matches(plan.tasks[j].id) || agentsOf[j].some((agent) => shown.has(agent));
    box.closest("li").hidden = !found;
    plan.tasks[j].isShown = chosen.has(j) && found;
    if (plan.tasks[j].group) plan.tasks[j].group.classList.toggle("dim", !plan.tasks[j].isShown);
  });
  for (const move of moves.values()) {
    move.path.classList.toggle("hidden", !move.agents.some((agent) => shown.has(agent)));
  }
  for (const way of returns.values()) way.path.classList.toggle("hidden", !way.agents.some((agent) => shown.has(agent)));
  plan.bases.forEach((base, b) => {
    const here = startsAt[b].filter((agent) => shown.has(agent));
    base.isShown = here.length > 0 || returnsTo[b].some((agent) => shown.has(agent));
    if (!base.group) return;
    base.group.classList.toggle("hidden", !base.isShown);
    base.inner.classList.toggle("hidden", !startsAt[b].length || here.some((agent) => agent.task >= 0));
  });
  const body = byId("agents").tBodies[0];
  body.replaceChildren();
  for (const agent of [...shown].slice(0, 500)) {
    const row = element(body, "tr", agent.violation ? { class: "violation", title: agent.violation } : {});
    agent.cells.forEach((cell) => element(row, "td", { title: cell }, cell));
  }
  if (shown.size > 500) element(element(body, "tr"), "td", { colspan: 9 }, `and ${shown.size - 500} more`);
  drawLabels();
}

// zoom
function nice(length) {
  const unit = 10 ** Math.floor(Math.log10(length));
  return [1, 2, 5, 10].map((part) => part * unit).find((step) => step >= length);
}
function drawGrid(width, height) {
  const grid = byId("grid");
  grid.replaceChildren();
  const value = (axis, at) => plan.origin[axis] + plan.scale[axis] * (axis ? plan.size - at : at);
  for (const axis of [0, 1]) {
    const ends = axis ? [value(1, (height - view.y) / view.k), value(1, -view.y / view.k)]
      : [value(0, -view.x / view.k), value(0, (width - view.x) / view.k)];
    const step = nice((ends[1] - ends[0]) / 8);
    const digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
    for (let count = Math.ceil(ends[0] / step); count * step <= ends[1]; count += 1) {
      const at = (count * step - plan.origin[axis]) / plan.scale[axis];
      const degree = plan.axes[axis].startsWith("longitude") ? ((count * step + 540) % 360) - 180 : count * step;
      const text = Math.abs(degree) >= 1e7 ? degree.toExponential(2) : degree.toFixed(Math.min(digits, 12));
      const line = axis ? [0, (plan.size - at) * view.k + view.y] : [at * view.k + view.x, 0];
      element(grid, "line", axis ? { x1: 0, x2: width, y1: line[1], y2: line[1] }
        : { x1: line[0], x2: line[0], y1: 0, y2: height });
      element(grid, "text", axis ? { x: 4, y: line[1] - 3 } : { x: line[0] + 3, y: height - 5 }, text);
    }
  }
  element(grid, "text", { x: width - 6, y: height - 20, "text-anchor": "end" }, plan.axes[0]);
  element(grid, "text", { x: 4, y: 14 }, plan.axes[1]);
}
function crosses([[ax, ay], [bx, by]], left, top, right, bottom) {
  let [from, to] = [0, 1]; // the part of the line that lies within the box
  for (const [at, step, low, high] of [[ax, bx - ax, left, right], [ay, by - ay, top, bottom]]) {
    if (!step && (at < low || at > high)) return false;
    const ends = step ? [(low - at) / step, (high - at) / step] : [0, 1];
    [from, to] = [Math.max(from, Math.min(...ends)), Math.min(to, Math.max(...ends))];
  }
  return from < to;
}
function drawLabels() {
  const labels = byId("labels");
  labels.replaceChildren();
  const { clientWidth: width, clientHeight: height } = svg;
  const taken = [24, 44].map((y) => [width - 70, y, 64]); // the zoom buttons
  const named = order.map((j) => plan.tasks[j]).filter((task) => task.place && task.isShown)
    .map((task) => ({ text: task.id, place: task.place, away: task.radius + 4 }));
  plan.bases.forEach((base, b) => {
    const here = startsAt[b].length;
    if (base.task === null && base.isShown)
      named.push({ text: here > 1 ? `${base.name} (${here})` : base.name, place: base.place, away: 10, class: "base" });
  });
  const lines = [...moves.values()].slice(0, 500).map((move) => [move.base.place, plan.tasks[move.task].place]
    .map(([x, y]) => [x * view.k + view.x, y * view.k + view.y]));
  const crossed = (a, b, half) => lines.filter((line) => crosses(line, a - half, b - 11, a + half, b + 3)).length;
  const marks = named.map(({ place, away }) => [place[0] * view.k + view.x, place[1] * view.k + view.y, away - 3]);
  const isOn = (a, b, half, [x, y, r]) => Math.hypot(Math.max(Math.abs(a - x) - half, 0), Math.max(Math.abs(b - 4 - y) - 6, 0)) < r;
  for (const { text, place, away, ...more } of named) {
    const [x, y] = [place[0] * view.k + view.x, place[1] * view.k + view.y];
    if (x < 0 || y < 0 || x > width || y > height || taken.length > 300) continue;
    const cut = text.length > 28 ? `${text.slice(0, 27)}…` : text;
    const half = 3.4 * cut.length;
    const spots = [[x, y - away], [x, y + away + 11], [x + away + half, y + 4], [x - away - half, y + 4]];
    const open = spots.filter(([a, b]) => !marks.some((mark) => isOn(a, b, half, mark))
      && !taken.some(([c, d, e]) => Math.abs(a - c) < half + e && Math.abs(b - d) < 14));
    if (!open.length) continue;
    const counts = open.map(([a, b]) => crossed(a, b, half));
    const free = open[counts.indexOf(Math.min(...counts))];
    taken.push([...free, half]);
    element(labels, "text", { x: free[0], y: free[1], "text-anchor": "middle", ...more }, cut);
  }
}
function draw() {
  byId("moving").setAttribute("transform", `translate(${view.x} ${view.y}) scale(${view.k})`);
  drawGrid(svg.clientWidth, svg.clientHeight);
  drawLabels();
}
function zoom(factor, x = svg.clientWidth / 2, y = svg.clientHeight / 2) {
  const k = Math.min(Math.max(view.k * factor, 0.05), 1e5);
  view = { k, x: x - ((x - view.x) * k) / view.k, y: y - ((y - view.y) * k) / view.k };
  draw();
}
function fit() {
  const all = [...plan.tasks, ...plan.bases].map((entry) => entry.place).filter(Boolean);
  const [left, right] = [Math.min(...all.map((p) => p[0])), Math.max(...all.map((p) => p[0]))];
  const [top, bottom] = [Math.min(...all.map((p) => p[1])), Math.max(...all.map((p) => p[1]))];
  const { clientWidth: width, clientHeight: height } = svg;
  const k = Math.min((width - 140) / (right - left || 1), (height - 140) / (bottom - top || 1));
  view = { k, x: width / 2 - (k * (left + right)) / 2, y: height / 2 - (k * (top + bottom)) / 2 };
  draw();
}
svg.addEventListener("wheel", (event) => {
  event.preventDefault();
  zoom(Math.exp(-0.0015 * event.deltaY), event.offsetX, event.offsetY);
}, { passive: false });
const pointers = new Map();
svg.onpointerdown = (event) => pointers.set(event.pointerId, event);
window.onpointermove = (event) => {
  const before = pointers.get(event.pointerId);
  if (!before) return;
  svg.classList.add("drag");
  const other = [...pointers.values()].find((pointer) => pointer.pointerId !== event.pointerId);
  if (other) {
    const apart = (pointer) => Math.hypot(pointer.clientX - other.clientX, pointer.clientY - other.clientY);
    const { left, top } = svg.getBoundingClientRect();
    zoom(apart(event) / (apart(before) || 1), other.clientX - left, other.clientY - top);
  } else {
    view = { ...view, x: view.x + event.clientX - before.clientX, y: view.y + event.clientY - before.clientY };
    draw();
  }
  pointers.set(event.pointerId, event);
};
window.onpointerup = window.onpointercancel = (event) => {
  pointers.delete(event.pointerId);
  svg.classList.remove("drag");
};
window.onresize = draw;
byId("in").onclick = () => zoom(1.5);
byId("out").onclick = () => zoom(1 / 1.5);
byId("fit").onclick = fit;
byId("all").onclick = () => choose(plan.tasks.keys());
byId("none").onclick = () => choose([]);
byId("idle").onchange = filter;
byId("search").oninput = (event) => { wanted = event.target.value.trim().toLowerCase(); filter(); };
byId("summary").textContent = plan.summary.join("\n");
byId("legend").children[1].hidden = !plan.tasks.some((task) => task.unserved);
byId("legend").children[3].hidden = !plan.agents.some((agent) => agent.task < 0);
byId("legend").children[4].hidden = !returns.size;
filter();
fit();
