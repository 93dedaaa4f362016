"use strict";
// Details of a single instance: the map with a plan, its groups, and the traces of runs.

let latest = 0; // call of showInstance: an earlier one draws no more
async function showInstance(index) {
  const mine = ++latest;
  const isLatest = () => latest === mine;
  state.instance = index;
  const { name, agents, tasks, chunk } = page.instances;
  byId("find").value = name[index];
  const detail = chunk[index] < 0 ? { traces: [], runs: 0, groups: [] } : JSON.parse(await unpack(`detail-${chunk[index]}`))[index];
  if (!isLatest()) return;
  const map = detail.map;
  const plans = map ? map.plans.filter((plan) => plan.group === state.group && !state.off.has(plan.method)).sort((one, other) => one.method - other.method) : [];
  let about = `${name[index]}: ${counted(agents[index], "agent")}, ${counted(tasks[index], "task")}.`;
  if (chunk[index] < 0) about += " Its map and traces are left out to keep the page small; other instances have theirs.";
  if (map && map.agents > map.agent.id.length) about += ` The map shows an evenly spaced subset of ${counted(map.agent.id.length, "agent")}.`;
  if (map && map.tasks > map.task.id.length) about += ` The map shows the ${counted(map.task.id.length, "task")} with the largest workload.`;
  if (detail.runs > page.most_traces) about += ` Traces of ${page.most_traces} of its runs are drawn.`;
  byId("size").textContent = about;
  if (!plans.some((plan) => plan.method === state.plan)) state.plan = plans.length ? plans[0].method : -1;
  byId("plans").replaceChildren();
  for (const plan of plans) {
    const figures = `T ${figure(plan.makespan, 4)}, energy ${figure(plan.energy, 4)}${plan.unserved ? `, ${plan.unserved} unserved` : ""}, seed ${plan.seed}`;
    const chip = add(byId("plans"), "button", "", { type: "button", "aria-pressed": plan.method === state.plan });
    add(chip, "i", "", { style: `background: ${colourOf(page, plan.method)}; border-color: ${colourOf(page, plan.method)}` });
    chip.append(`${page.labels[plan.method]}: ${figures}`);
    chip.onclick = () => { state.plan = plan.method; showInstance(index); };
  }
  const others = map ? map.plans.some((plan) => plan.group === state.group) : false;
  const none = !detail.groups.includes(state.group) ? "No plan is stored: the instance was not run under these conditions."
    : others ? "No plan is shown: stored plans are of methods that are deselected above."
    : "No plan is stored under these conditions: no run was solved, or an older version of alloc did not store plans.";
  await showPlan(map, plans.find((plan) => plan.method === state.plan), none, isLatest);
  if (isLatest()) await showTraces(detail.traces);
}
const caption = (id, title, note) => {
  const place = byId(id).querySelector("figcaption");
  place.replaceChildren();
  add(place, "b", title);
  place.append(note);
};
async function showPlan(map, plan, none, isLatest) {
  const chart = byId("place").querySelector(".chart");
  const [width, height] = [Math.max(chart.clientWidth - 75, 180), window.innerWidth < 760 ? 320 : 420];
  caption("place", plan ? `Plan of ${page.labels[plan.method]}` : "Map", plan
    ? "Sites by workload (area) and time done; orange rings are unserved. Squares are starts, hollow where all stay idle. Drag to move, turn the wheel to zoom."
    : "Sites by workload (area); squares are starts. Drag to move, turn the wheel to zoom.");
  const [laid, zoom] = map ? await drawMap(chart, map, plan, width, height) : [null, null];
  if (!isLatest()) return;
  byId("zoom").hidden = !zoom;
  byId("groups").hidden = !plan;
  if (!zoom) await draw(chart, map ? "There is no map: the instance has no positions." : "There is no map: it is left out here, or an older version of alloc did not store this instance.");
  else if (!plan) add(chart, "p", none, { class: "none" });
  for (const [id, factor] of [["in", 1 / 1.6], ["out", 1.6], ["fit", 0]]) byId(id).onclick = () => zoom(factor);
  if (!plan || !isLatest()) return;
  makeTable(byId("groups").querySelector("table"), [text("task", (task) => task.id), number("workload", (task) => task.work), number("done at", (task) => task.done),
    number("ability", (task) => task.ability), number("agents", (task) => task.count), text("who", (task) => task.count ? listed(task.agents, task.count) : "-")],
  laid.tasks, { paging: laid.tasks.length > 25 });
}
async function showTraces(traces) {
  const own = traces.filter((one) => one.group === state.group && !state.off.has(one.method) && one.steps.length);
  const chart = byId("trace").querySelector(".chart");
  caption("trace", "Traces of runs", "Makespan of the best plan so far, one line per run.");
  if (!own.length) return draw(chart, "There is nothing to draw: no run has a trace with a makespan.");
  const end = Math.max(...own.map((one) => one.steps[one.steps.length - 2])) + 2;
  const last = page.edges_s.length - 1;
  const values = own.flatMap((one) => {
    const points = one.steps.flatMap((step, i) => (i % 2 ? [] : [{ x: step, y: one.steps[i + 1] }]));
    points.push({ x: end, y: points[points.length - 1].y });
    return points.map(({ x, y }) => ({ x: page.edges_s[Math.min(x, last)], y, method: page.labels[one.method], seed: one.seed, run: `${one.method} ${one.seed}` }));
  });
  const methods = [...new Set(own.map((one) => one.method))];
  const { color, strokeDash } = byMethod(page, methods, chart.clientWidth);
  return draw(chart, { height: 340, data: { values }, mark: { type: "line", interpolate: "step-after", strokeWidth: 1.5, opacity: 0.8, tooltip: true },
    encoding: { x: quantitative("x", "time (s)", seconds), y: quantitative("y", "T", { scale: { zero: false } }), color, strokeDash, detail: { field: "run" } } });
}
function layInstances() {
  const numbers = new Map(page.instances.name.map((name, i) => [name, i]));
  byId("find").onfocus = () => {
    byId("find").select();
    if (!byId("names").children.length) page.instances.name.slice(0, 3000).forEach((name) => add(byId("names"), "option", "", { value: name }));
  };
  byId("find").onchange = () => {
    const wanted = byId("find").value.trim();
    const index = numbers.get(wanted) ?? page.instances.name.findIndex((name) => name.toLowerCase().includes(wanted.toLowerCase()));
    if (index >= 0) showInstance(index);
  };
  const total = page.instances.name.length;
  byId("before").onclick = () => showInstance((state.instance + total - 1) % total);
  byId("after").onclick = () => showInstance((state.instance + 1) % total);
}
