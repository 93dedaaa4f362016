"use strict";
const mission = JSON.parse(document.getElementById("mission").textContent);
const byId = (name) => document.getElementById(name);
const { agents, tasks, agentStates, taskStates, end } = mission;
const stateOf = Object.fromEntries(taskStates.map((state, number) => [state.name, number]));
const WORKS = 0;
const DURATION = 30; // of the whole mission at speed 1, in seconds
const canvas = byId("map");
const player = { hour: 0, isPlaying: false, followed: -1, showsKnown: false, zoom: d3.zoomIdentity };
const hours = (value) => `${value.toFixed(end < 10 ? 2 : 1)} ${mission.unit || "h"}`;
const colourOf = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

// the true state at an hour
const firstAfter = d3.bisector((leg) => leg[0]).right;
const legAt = (agent, hour) => agent.legs[firstAfter(agent.legs, hour) - 1];
function placeAt(agent, hour) {
  const leg = legAt(agent, hour);
  if (!leg || !leg[2] || !leg[3]) return leg ? leg[2] : null;
  const share = leg[1] > leg[0] ? Math.min(1, Math.max(0, (hour - leg[0]) / (leg[1] - leg[0]))) : 1;
  return [0, 1].map((axis) => leg[2][axis] + share * (leg[3][axis] - leg[2][axis]));
}
function taskAt(task, hour) {
  const after = firstAfter(task.levels, hour);
  const [begin, left, status] = task.levels[Math.max(after - 1, 0)];
  if (status === "to come") return null;
  if (after >= task.levels.length || status !== "open") return { left, status };
  const [until, then] = task.levels[after];
  return { left: until > begin ? left + (hour - begin) / (until - begin) * (then - left) : left, status };
}
const most = tasks.map((task) => d3.max(task.levels, (level) => level[1]) || 0);
const largest = d3.max(most) || 1;
const spans = tasks.map(() => []); // intervals of work at each task: [begin, end]
agents.forEach((agent) => agent.legs.forEach((leg) => { if (leg[4] === WORKS && leg[5] >= 0) spans[leg[5]].push([leg[0], leg[1]]); }));
const isWorkedOn = (j, hour) => spans[j].some(([begin, until]) => begin <= hour && hour < until);
function stateAt(j, hour) {
  const found = taskAt(tasks[j], hour);
  if (!found) return null;
  const name = found.status !== "open" ? found.status : isWorkedOn(j, hour) ? "in progress" : "waiting";
  return { ...found, name, number: stateOf[name] };
}

// the knowledge of agents: everything was true at the hour of its last report
const knowledge = mission.knowledge && { ...mission.knowledge, reports: null };
if (knowledge) {
  const bytes = Uint8Array.from(atob(mission.knowledge.reports), (letter) => letter.charCodeAt(0));
  const view = new DataView(bytes.buffer);
  knowledge.reports = Uint16Array.from({ length: bytes.length / 2 }, (_, i) => view.getUint16(2 * i, true));
}
function reportsOf(agent, hour) {
  const row = knowledge ? knowledge.agents.indexOf(agent) : -1;
  if (row < 0) return null;
  const moment = Math.max(d3.bisectRight(knowledge.hours, hour) - 1, 0);
  const width = agents.length + tasks.length;
  const first = (row * knowledge.hours.length + moment) * width;
  return (subject) => {
    const step = knowledge.reports[first + subject];
    return step ? Math.min((step - 1) / knowledge.steps * end, hour) : null;
  };
}
const isKnownShown = () => player.showsKnown && player.followed >= 0 && reportsOf(player.followed, player.hour) !== null;

// the map
const margin = { left: 46, right: 12, top: 12, bottom: 34 };
let scales = null;
function scaled() {
  const { clientWidth: width, clientHeight: height } = canvas;
  if (!mission.window) return null;
  const [[left, low], [right, high]] = mission.window;
  const [across, up] = [(right - left) || 1, ((high - low) || 1) * mission.aspect];
  const inner = [width - margin.left - margin.right, height - margin.top - margin.bottom];
  const size = Math.min(inner[0] / across, inner[1] / up);
  const rest = [(inner[0] - size * across) / 2, (inner[1] - size * up) / 2];
  const x = d3.scaleLinear([left, left + across], [margin.left + rest[0], margin.left + rest[0] + size * across]);
  const y = d3.scaleLinear([low, low + up / mission.aspect], [margin.top + rest[1] + size * up, margin.top + rest[1]]);
  return { x: player.zoom.rescaleX(x), y: player.zoom.rescaleY(y) };
}
const toScreen = (place) => [scales.x(place[0]), scales.y(place[1])];
function disc(pen, [x, y], radius, fill, edge, width = 1.5) {
  pen.beginPath();
  pen.arc(x, y, radius, 0, 2 * Math.PI);
  if (fill) { pen.fillStyle = fill; pen.fill(); }
  if (edge) { pen.strokeStyle = edge; pen.lineWidth = width; pen.stroke(); }
}
function drawText(pen, text, x, y, align = "center") {
  pen.font = "12px system-ui, sans-serif";
  pen.textAlign = align;
  pen.lineWidth = 3;
  pen.strokeStyle = colourOf("--halo");
  pen.strokeText(text, x, y);
  pen.fillStyle = colourOf("--text");
  pen.fillText(text, x, y);
}
function prepareCanvas(target) {
  const ratio = window.devicePixelRatio || 1;
  const [width, height] = [Math.round(target.clientWidth * ratio), Math.round(target.clientHeight * ratio)];
  if (target.width !== width || target.height !== height) Object.assign(target, { width, height });
  const pen = target.getContext("2d");
  pen.setTransform(ratio, 0, 0, ratio, 0, 0);
  pen.clearRect(0, 0, target.clientWidth, target.clientHeight);
  return pen;
}
let marks = [];
function drawMap() {
  const pen = prepareCanvas(canvas);
  marks = [];
  if (player.followed >= 0 && player.zoom.k > 1) centre();
  scales = scaled();
  if (!scales) return drawText(pen, "no positions are given", canvas.clientWidth / 2, canvas.clientHeight / 2);
  drawAxes(pen);
  const reports = isKnownShown() ? reportsOf(player.followed, player.hour) : null;
  if (player.followed >= 0) drawReach(pen);
  drawTrails(pen, reports);
  tasks.forEach((task, j) => drawTask(pen, task, j, reports));
  const groups = new Map(); // agents at one position are drawn around it
  for (const i of agents.keys()) {
    const hour = reports && i !== player.followed ? reports(i) : player.hour;
    const place = hour === null ? null : placeAt(agents[i], hour);
    if (!place) continue;
    const spot = toScreen(place);
    const key = spot.map(Math.round).join();
    if (!groups.has(key)) groups.set(key, []);
    groups.get(key).push({ i, hour, spot, isAged: reports !== null && i !== player.followed });
  }
  for (const group of groups.values()) group.forEach((one, rank) => drawAgent(pen, one, rank, group.length));
}
function drawAxes(pen) {
  const { clientWidth: width, clientHeight: height } = canvas;
  const [x, y] = [d3.axisBottom(scales.x).ticks(width / 90), d3.axisLeft(scales.y).ticks(height / 70)];
  for (const [scale, ends] of [[scales.x, [margin.left, width - margin.right]], [scales.y, [height - margin.bottom, margin.top]]]) {
    scale.domain(ends.map(scale.invert)).range(ends); // the grid goes on to the edges
  }
  d3.select("#x").attr("transform", `translate(0,${height - margin.bottom})`).call(x);
  d3.select("#y").attr("transform", `translate(${margin.left},0)`).call(y);
  d3.select("#xname").attr("x", width - margin.right).attr("y", height - 5).attr("text-anchor", "end").text(mission.axes[0]);
  d3.select("#yname").attr("x", 6).attr("y", 12).text(mission.axes[1]);
  pen.strokeStyle = colourOf("--grid");
  pen.lineWidth = 1;
  pen.beginPath();
  for (const at of scales.x.ticks(width / 90)) { pen.moveTo(scales.x(at), 0); pen.lineTo(scales.x(at), height - margin.bottom); }
  for (const at of scales.y.ticks(height / 70)) { pen.moveTo(margin.left, scales.y(at)); pen.lineTo(width, scales.y(at)); }
  pen.stroke();
}
function drawReach(pen) {
  const place = placeAt(agents[player.followed], player.hour);
  if (!place || mission.isFull || mission.aspect !== 1) return; // degrees are no lengths
  for (const [reach, dash] of [[mission.sensing, []], [mission.radius, [5, 4]]]) {
    if (reach === null) continue;
    pen.setLineDash(dash);
    disc(pen, toScreen(place), Math.abs(scales.x(reach) - scales.x(0)), null, colourOf("--soft"), 1);
  }
  pen.setLineDash([]);
}
function drawTrails(pen, reports) {
  const shown = player.followed >= 0 ? [player.followed] : reports ? [] : agents.keys();
  const since = player.followed >= 0 ? 0 : Math.max(0, player.hour - 0.08 * end);
  for (const i of shown) {
    const agent = agents[i];
    const begin = placeAt(agent, since) || (agent.legs[0] || [])[2];
    if (!begin) continue;
    pen.beginPath();
    pen.moveTo(...toScreen(begin));
    for (const leg of agent.legs) {
      if (leg[0] > player.hour) break;
      if (leg[0] >= since && leg[2]) pen.lineTo(...toScreen(leg[2]));
    }
    const now = placeAt(agent, player.hour);
    if (now) pen.lineTo(...toScreen(now));
    pen.strokeStyle = trailColour(agent);
    pen.globalAlpha = agents.length > 50 ? 0.35 : 0.6;
    pen.lineWidth = 1.5;
    pen.stroke();
    pen.globalAlpha = 1;
  }
}
const trailColour = (agent) => (agents.length > 7 || agent.colour === "#000000" ? colourOf("--soft") : agent.colour);
function drawTask(pen, task, j, reports) {
  const hour = reports ? reports(agents.length + j) : player.hour;
  const found = hour === null || !task.place ? null : stateAt(j, hour);
  if (!found) return;
  const [place, shrink] = [toScreen(task.place), Math.min(1, Math.sqrt(60 / tasks.length))];
  const full = 4 + 16 * shrink * Math.sqrt(most[j] / largest);
  const { colour, name } = taskStates[found.number];
  const isOver = found.status !== "open";
  pen.globalAlpha = reports ? freshness(hour) : 1;
  disc(pen, place, isOver ? Math.max(4, 0.5 * full) : full, isOver ? colour : colourOf("--back"), colour, 2);
  const share = most[j] ? found.left / most[j] : 0;
  if (!isOver && share > 0) disc(pen, place, full * Math.sqrt(Math.min(1, share)), colour, null);
  if (name === "missed") cross(pen, place, 4, colourOf("--back"));
  pen.globalAlpha = 1;
  const age = reports ? `\nas of ${hours(hour)}` : "";
  const rest = isOver ? "" : `, ${found.left.toPrecision(3)} of work left${task.deadline === null ? "" : `, deadline ${hours(task.deadline)}`}`;
  marks.push({ place, reach: full, text: `${task.id}: ${name}${rest}${age}` });
  if (tasks.length <= 60) drawText(pen, task.id.length > 18 ? `${task.id.slice(0, 17)}…` : task.id, place[0], place[1] - full - 4);
}
function cross(pen, [x, y], size, colour) {
  pen.beginPath();
  pen.moveTo(x - size, y - size); pen.lineTo(x + size, y + size);
  pen.moveTo(x + size, y - size); pen.lineTo(x - size, y + size);
  pen.strokeStyle = colour;
  pen.lineWidth = 2;
  pen.stroke();
}
const freshness = (hour) => Math.max(0.25, 1 - 4 * (player.hour - hour) / end);
function drawAgent(pen, { i, hour, spot, isAged }, rank, groupSize) {
  const agent = agents[i];
  const leg = legAt(agent, hour);
  const state = agentStates[leg[4]];
  const size = (agents.length > 100 ? 2.5 : agents.length > 20 ? 4 : 5.5) * (i === player.followed ? 1.6 : 1);
  const isRing = groupSize <= 8; // larger groups are packed in a sunflower spiral
  const angle = isRing ? 2 * Math.PI * rank / groupSize : 2.39996 * rank;
  const away = isRing ? (groupSize > 1 ? 1.6 * size + 0.4 * size * groupSize : 0) : 1.9 * size * Math.sqrt(rank);
  const [x, y] = [spot[0] + away * Math.cos(angle), spot[1] + away * Math.sin(angle)];
  pen.globalAlpha = isAged ? freshness(hour) : 1;
  if (!state) cross(pen, [x, y], size, colourOf("--text"));
  else {
    pen.beginPath();
    pen.rect(x - size, y - size, 2 * size, 2 * size);
    pen.fillStyle = state.colour;
    pen.fill();
    pen.strokeStyle = colourOf(i === player.followed ? "--text" : "--edge");
    pen.lineWidth = i === player.followed ? 2.5 : agents.length > 100 ? 0.5 : 1;
    pen.stroke();
  }
  pen.globalAlpha = 1;
  const where = leg[5] >= 0 ? ` (${tasks[leg[5]].id})` : "";
  marks.push({ place: [x, y], reach: size + 2, agent: i,
    text: `${agent.id}: ${state ? state.name : "failed"}${where}${isAged ? `\nas of ${hours(hour)}` : ""}` });
  if (agents.length <= 25 || i === player.followed) drawText(pen, agent.id, x + size + 4, y + 4, "left");
}

// the Gantt chart, with the current hour
function drawGantt() {
  const chart = byId("gantt");
  const row = Math.min(9, 120 / Math.max(agents.length, 1));
  chart.style.height = `${Math.max(12, row * agents.length)}px`;
  const pen = prepareCanvas(chart);
  const x = d3.scaleLinear([0, end || 1], [0, chart.clientWidth]);
  agents.forEach((agent, i) => {
    for (const [begin, until, , , state] of agent.legs) {
      if (state < 0) continue;
      pen.globalAlpha = player.followed < 0 || player.followed === i ? 1 : 0.3;
      pen.fillStyle = agentStates[state].colour;
      pen.fillRect(x(begin), i * row, Math.max(x(until) - x(begin), 0.3), row > 3 ? row - 1 : Math.max(row, 0.7));
    }
  });
  pen.globalAlpha = 1;
  pen.fillStyle = colourOf("--text");
  pen.fillRect(x(player.hour) - 1, 0, 2, chart.clientHeight);
}

// a row of the table of counts, which is also the legend of the map
function addCount(rows) {
  const added = rows.append("tr");
  const name = added.append("td");
  name.append("i").attr("class", (row) => row.kind).style("background", (row) => row.colour);
  name.append("span").text((row) => row.name);
  added.append("td");
  return added;
}
function updatePanel() {
  const { hour } = player;
  byId("clock").textContent = hours(hour);
  byId("hour").value = hour;
  byId("play").textContent = player.isPlaying ? "pause" : "play";
  const states = tasks.map((_, j) => stateAt(j, hour)).filter(Boolean);
  const rows = taskStates.map(({ name, colour }) => ({ kind: "task", name: `tasks ${name}`, colour,
    value: states.filter((one) => one.name === name).length }));
  agentStates.forEach(({ name, colour }, number) => rows.push({ kind: "agent", name: `agents ${name}`, colour,
    value: agents.filter((agent) => (legAt(agent, hour) || [])[4] === number).length }));
  rows.push({ kind: "other", name: "work left", value: d3.sum(states, (one) => one.left).toFixed(1) });
  rows.push({ kind: "other", name: "messages so far", value: d3.bisector((one) => one[0]).right(mission.messages, hour) });
  d3.select("#counts tbody").selectAll("tr").data(rows).join(addCount).select("td:last-child").text((row) => row.value);
  byId("about").textContent = about();
}
function about() {
  const { followed, hour } = player;
  if (followed < 0) return "Click an agent, or choose one above, to follow it. Wheel and drag zoom and move the map.";
  const leg = legAt(agents[followed], hour);
  const state = leg && agentStates[leg[4]];
  const doing = `${agents[followed].id} ${!leg ? "has not joined" : state ? `is ${state.name}` : "has failed"}${leg && leg[5] >= 0 ? ` (${tasks[leg[5]].id})` : ""}.`;
  if (mission.isFull) return `${doing}\nFull knowledge: all agents know the true state.`;
  const reports = reportsOf(followed, hour);
  if (!reports) return `${doing}\nIts knowledge was not recorded.`;
  const there = tasks.map((_, j) => j).filter((j) => taskAt(tasks[j], hour));
  const known = there.filter((j) => reports(agents.length + j) !== null);
  const wrong = known.filter((j) => taskAt(tasks[j], reports(agents.length + j))?.status !== taskAt(tasks[j], hour).status);
  const age = d3.max(known, (j) => hour - reports(agents.length + j));
  return `${doing}\nIt knows ${known.length} of ${there.length} tasks${known.length ? `; the oldest report is ${hours(age)} old` : ""}${
    wrong.length ? `; it does not know that ${wrong.length} of them ${wrong.length === 1 ? "is" : "are"} closed` : ""}.`;
}
function draw() {
  drawMap();
  drawGantt();
  updatePanel();
}

// interaction
function go(hour) { player.hour = Math.min(end, Math.max(0, hour)); draw(); }
let last = null;
function step(now) {
  if (!player.isPlaying) return;
  const passed = last === null ? 0 : (now - last) / 1000;
  last = now;
  go(player.hour + passed * Number(byId("speed").value) * end / DURATION);
  if (player.hour >= end) play(false);
  else requestAnimationFrame(step);
}
function play(isPlaying) {
  if (isPlaying && player.hour >= end) player.hour = 0;
  Object.assign(player, { isPlaying });
  last = null;
  if (isPlaying) requestAnimationFrame(step);
  updatePanel();
}
function follow(agent) {
  player.followed = agent;
  byId("follow").value = agent;
  byId("knowing").hidden = agent < 0 || !knowledge || !knowledge.agents.includes(agent);
  draw();
}
const zoom = d3.zoom().scaleExtent([1, 60]).on("zoom", (event) => { player.zoom = event.transform; if (event.sourceEvent) draw(); });
function centre() {
  const place = placeAt(agents[player.followed], player.hour);
  const current = scaled();
  if (!place || !current) return;
  const moved = [canvas.clientWidth / 2 - current.x(place[0]), canvas.clientHeight / 2 - current.y(place[1])];
  player.zoom = d3.zoomIdentity.translate(player.zoom.x + moved[0], player.zoom.y + moved[1]).scale(player.zoom.k);
  canvas.__zoom = player.zoom;
}
d3.select(canvas).call(zoom).on("dblclick.zoom", null);
const nearest = (event) => {
  const [x, y] = d3.pointer(event, canvas);
  return marks.filter(({ place, reach }) => Math.hypot(place[0] - x, place[1] - y) <= reach + 3).at(-1);
};
canvas.addEventListener("pointermove", (event) => {
  const found = nearest(event);
  const box = byId("hover");
  box.hidden = !found;
  if (!found) return;
  box.textContent = found.text;
  const [x, y] = d3.pointer(event, canvas);
  box.style.left = `${Math.min(x + 14, canvas.clientWidth - box.offsetWidth - 4)}px`;
  box.style.top = `${Math.min(y + 14, canvas.clientHeight - box.offsetHeight - 4)}px`;
});
canvas.addEventListener("pointerleave", () => { byId("hover").hidden = true; });
canvas.addEventListener("click", (event) => {
  const found = nearest(event);
  if (found && found.agent !== undefined) follow(found.agent === player.followed ? -1 : found.agent);
});
byId("play").onclick = () => play(!player.isPlaying);
byId("hour").max = end || 1;
byId("hour").oninput = (event) => {
  const hour = Number(event.target.value);
  play(false);
  go(hour);
};
byId("gantt").onclick = (event) => go(d3.pointer(event, byId("gantt"))[0] / byId("gantt").clientWidth * end);
byId("follow").onchange = (event) => follow(Number(event.target.value));
byId("truth").onchange = byId("known").onchange = () => { player.showsKnown = byId("known").checked; draw(); };
byId("fit").onclick = () => { d3.select(canvas).call(zoom.transform, d3.zoomIdentity); draw(); };
document.addEventListener("keydown", (event) => {
  if (/^(INPUT|SELECT|BUTTON)$/.test(event.target.tagName) && event.target.type !== "range") return;
  if (event.key === " ") { event.preventDefault(); play(!player.isPlaying); }
});
window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
window.addEventListener("resize", draw);

const [heading, ...below] = mission.summary;
byId("heading").textContent = heading;
byId("summary").textContent = below.join("\n");
agents.forEach((agent, i) => byId("follow").add(new Option(agent.id, i)));
const parameters = new URLSearchParams(location.hash.slice(1)); // such as #hour=3&follow=a2&known
if (parameters.has("hour")) player.hour = Math.min(end, Math.max(0, Number(parameters.get("hour")) || 0));
if (parameters.has("known")) { byId("known").checked = player.showsKnown = true; }
follow(agents.findIndex((agent) => agent.id === parameters.get("follow")));
