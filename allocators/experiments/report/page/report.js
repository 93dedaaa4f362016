"use strict";
// The page: selections and redrawing. All stored data are inserted as text, never as HTML.

const byId = (id) => document.getElementById(id);
const state = { group: 0, off: new Set(), instance: -1, plan: -1, measure: "runtime_s", against: -1 };
const SOON = 20000; // runs up to which their table is made at once; more of them wait until one looks at it
let page, runs, turn = 0;

async function unpack(id) {
  const bytes = Uint8Array.from(atob(byId(`data-${id}`).textContent), (letter) => letter.charCodeAt(0));
  return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"))).text();
}
async function load(id) {
  const address = URL.createObjectURL(new Blob([await unpack(id)], { type: "text/javascript" }));
  return import(address).finally(() => URL.revokeObjectURL(address));
}
function add(parent, name, text = "", attributes = {}) {
  const made = parent.appendChild(document.createElement(name));
  made.textContent = text;
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  return made;
}
const group = () => page.groups[state.group];
const shown = () => group().methods.map((one) => one.method).filter((method) => !state.off.has(method));
const figure = (value, digits = 5) => (value === null || value === undefined ? "-" : String(Number(value.toPrecision(digits))));
const share = (value, digits = 3) => (value === null || value === undefined ? "-" : Math.abs(value) < 5e-7 ? "0 %" : `${Number((100 * value).toPrecision(digits))} %`);
const signed = (value) => (value === null ? "-" : `${value > 0 ? "+" : ""}${share(value)}`);
const chance = (value) => (value !== null && value < 1e-3 ? value.toExponential(1) : figure(value, 2));
const counted = (count, noun) => `${count.toLocaleString("en")} ${noun}${count === 1 ? "" : "s"}`;
const escaped = (text) => String(text).replace(/[&<>"']/g, (letter) => `&#${letter.charCodeAt(0)};`);
const when = (seconds) => new Date(1000 * seconds).toISOString().slice(0, 16).replace("T", " ");

// charts
async function embed(element, spec) {
  element.drawn?.finalize(); // it would go on to listen for another size of the window
  element.drawn = await vegaEmbed(element, { config: config(), ...spec }, { mode: "vega-lite", renderer: "svg", actions: { export: true, source: false, compiled: false, editor: false }, tooltip: { theme: isDark() ? "dark" : "light" } });
  if (!element.isConnected) element.drawn.finalize(); // it left the page meanwhile
  return element.drawn;
}
async function draw(element, spec) {
  if (typeof spec === "string") {
    element.replaceChildren();
    add(element, "p", spec, { class: "none" });
  } else await embed(element, { width: "container", height: 270, autosize: { type: "fit-x", contains: "padding" }, ...spec });
}
function layFigures() {
  for (const chart of CHARTS) {
    const made = add(byId("figures"), "figure", "", { id: `chart-${chart.id}` });
    const caption = add(made, "figcaption");
    add(caption, "b", chart.title);
    add(caption, "span", chart.note);
    add(made, "div", "", { class: "chart" });
    if (!chart.measures) continue;
    const select = add(caption, "select", "", { "aria-label": "measure" });
    Object.entries(chart.measures).forEach(([value, title]) => add(select, "option", title, { value }));
    select.onchange = () => { state.measure = select.value; drawCharts(); };
  }
}
async function drawCharts() {
  const mine = ++turn;
  for (const chart of CHARTS) {
    const element = byId(`chart-${chart.id}`).querySelector(".chart");
    if (chart.more) byId(`chart-${chart.id}`).querySelector("span").textContent = `${chart.note} ${chart.more(group(), shown())}`;
    await draw(element, chart.draw(page, group(), shown(), element.clientWidth, state.measure));
    await new Promise((done) => setTimeout(done));
    if (turn !== mine) return;
  }
}

// what was run
function tellAll() {
  byId("about").textContent = `${page.stores.join(", ")}; written ${page.made} by alloc ${page.version}`;
  const all = page.groups.flatMap((one) => one.methods);
  const failed = all.reduce((sum, one) => sum + one.runs - (one.outcomes.solved || 0), 0);
  const total = all.reduce((sum, one) => sum + one.runs, 0);
  const cards = { runs: total, instances: page.instances.name.length, methods: page.labels.length, conditions: page.groups.length, "runs not solved": failed };
  const seconds = page.groups.reduce((sum, one) => sum + one.conditions.cpu_s, 0);
  const [unit, length] = seconds < 3600 ? ["seconds", 1] : ["hours", 3600];
  for (const [name, value] of [...Object.entries(cards).map(([key, count]) => [key, count.toLocaleString("en")]), [`processor ${unit}`, figure(seconds / length, 3)]])
    add(add(byId("cards"), "div", name), "b", value);
  byId("cards").querySelectorAll("div").forEach((card) => card.prepend(card.lastChild));
  const of = (get) => (index) => get(page.groups[index].conditions);
  const limit = (one) => [one.time_limit_s === null ? "" : `${one.time_limit_s} s`, one.iterations === null ? "" : counted(one.iterations, "iteration"),
    one.target_gap === null ? "" : `gap ${share(one.target_gap)}`].filter(Boolean).join(", ") || "none";
  page.groups.forEach((one, i) => add(byId("group"), "option", `${[one.conditions.objective, ...one.conditions.others].join(", ")}, ${limit(one.conditions)}, ${one.conditions.version}, ${counted(one.conditions.runs, "run")}`, { value: i }));
  byId("group").onchange = () => choose(Number(byId("group").value));
  byId("pick").hidden = page.groups.length < 2;
  makeTable(byId("conditions"), [text("objective", of((one) => [one.objective, ...one.others].join(", "))), text("budget", of(limit)), number("threads", of((one) => one.threads)),
    number("runs", of((one) => one.runs)), number("instances", of((one) => one.instances)), text("version", of((one) => one.version)),
    text("commit", of((one) => one.revision.replace(/[0-9a-f]{40}/g, (hash) => hash.slice(0, 10)) || "-")), text("machine", of((one) => one.machine)),
    text("from (UTC)", of((one) => one.from)), text("to", of((one) => one.to))],
  page.groups.map((_, i) => i), { pick: choose, paging: page.groups.length > 25 });
}
function layChips() {
  byId("chips").replaceChildren();
  for (const { method } of group().methods) {
    const chip = add(byId("chips"), "button", "", { type: "button", "aria-pressed": !state.off.has(method) });
    const colour = colourOf(page, method);
    add(chip, "i", "", { style: `background: ${colour}; border-color: ${colour}` });
    chip.append(page.labels[method]);
    chip.onclick = () => {
      if (!state.off.delete(method)) state.off.add(method);
      update(false);
    };
  }
}
function tellMethods() {
  byId("notes").replaceChildren();
  group().notes.forEach((note) => add(byId("notes"), "li", note));
  const rows = group().methods.filter((one) => !state.off.has(one.method));
  const columns = [text("method", (one) => page.labels[one.method]), number("runs", (one) => one.runs), number("solved", (one) => one.solved, share),
    number("proven", (one) => one.proven), number("instances", (one) => one.instances), number("served", (one) => one.served),
    number("best on", (one) => one.best), number("T / best", (one) => one.ratio), number("T", (one) => one.makespan), number("gap", (one) => one.gap, share),
    number("energy", (one) => one.energy), number("time (s)", (one) => one.runtime_s, (value) => figure(value, 3)),
    number("memory (MiB)", (one) => one.memory_mb, (value) => figure(value, 3))];
  if (rows.some((one) => one.picked)) columns.push(text("ran", (one) => one.picked));
  makeTable(byId("summary"), columns, rows);
}
function tellPaired() {
  const place = byId("paired");
  place.querySelectorAll("table").forEach(dropTable); // what leaves the page would else be kept for ever
  place.querySelectorAll(".chart").forEach((chart) => chart.drawn?.finalize());
  place.replaceChildren();
  const references = [...new Set(group().paired.map((one) => one.against))];
  if (!references.length) {
    add(place, "p", "There is nothing to compare: differences need two methods with results on the same instances.", { class: "none" });
    return;
  }
  if (!references.includes(state.against)) state.against = references[0];
  const line = add(place, "label", "against ");
  const select = add(line, "select", "", { id: "against" });
  references.forEach((method) => add(select, "option", page.labels[method], { value: method }));
  select.value = state.against;
  select.onchange = () => { state.against = Number(select.value); tellPaired(); };
  add(place, "p", `Relative differences on the same instances, with 95 % BCa bootstrap intervals of the mean, and Wilcoxon's signed-rank test, two-sided, corrected by
    Holm's procedure. Instances on which one of the two has no score are left out. Energies are at each method's own makespan; less energy at a longer one is not better.`, { class: "hint" });
  for (const score of ["makespan", "energy"]) {
    const rows = group().paired.filter((one) => one.score === score && one.against === state.against && !state.off.has(one.method));
    if (!rows.length) continue;
    const name = score === "makespan" ? "T" : "energy";
    makeTable(add(add(place, "div", "", { class: "table" }), "table"), [text(`${name} of`, (one) => page.labels[one.method]),
      number("less", (one) => one.better), number("equal", (one) => one.equal), number("more", (one) => one.worse),
      number("difference", (one) => one.mean, signed), number("from", (one) => one.low, signed), number("to", (one) => one.high, signed),
      number("p", (one) => one.p, chance), number("p (Holm)", (one) => one.p_holm, chance),
      number("instances", (one) => one.instances), number("left out", (one) => one.left_out), text("", (one) => (one.small ? "small sample" : ""))], rows);
    const known = rows.filter((one) => one.low !== null);
    if (known.length) draw(add(place, "div", "", { class: "chart" }), differences(page, known, place.clientWidth));
  }
}

// runs
async function tellRuns() {
  runs = JSON.parse(await unpack("runs"));
  const of = (name) => (row) => runs[name][row];
  const columns = [text("instance", (row) => page.instances.name[runs.instance[row]]), number("agents", (row) => page.instances.agents[runs.instance[row]]),
    number("tasks", (row) => page.instances.tasks[runs.instance[row]]), text("method", (row) => page.labels[runs.method[row]]), number("seed", of("seed"), String),
    text("outcome", of("outcome")), text("status", of("status")), number("T", of("makespan"), (value) => figure(value, 6)), number("gap", of("gap"), share),
    number("energy", of("energy")), number("unserved", of("unserved")), number("time (s)", of("runtime_s"), (value) => figure(value, 4)),
    number("memory (MiB)", of("memory_mb"), (value) => figure(value, 3)), text("began (UTC)", (row) => when(runs.started[row]))];
  makeTable(byId("all"), columns, runs.seed.map((_, row) => row), { paging: true, filters: true, pick: showRun });
  filterRuns();
}
const filterRuns = () => runs && tables.get(byId("all")).search.fixed("chosen", (_, [row]) => runs.group[row] === state.group && !state.off.has(runs.method[row])).draw();
function showRun(row) {
  const place = byId("run").querySelector("div");
  place.replaceChildren();
  const failure = page.failures[runs.failure[row]];
  const name = page.instances.name[runs.instance[row]];
  add(place, "h3", `${page.labels[runs.method[row]]} on ${name}, seed ${runs.seed[row]}`);
  const list = add(place, "dl");
  const told = { outcome: "outcome", status: "status", stop_reason: "stop reason", makespan: "T", served_makespan: "T of served tasks", lower_bound: "bound on T",
    gap: "gap to the best bound", energy: "energy", unserved: "unserved tasks", runtime_s: "time (s)", cpu_s: "processor time (s)", memory_mb: "memory (MiB)" };
  for (const [field, title] of Object.entries(told)) {
    const value = runs[field][row];
    add(list, "dt", title);
    add(list, "dd", typeof value === "string" ? value || "-" : field === "gap" ? share(value) : figure(value, 6));
  }
  if (failure) tellFailure(place, failure);
  const button = add(place, "button", "map and traces of this instance", { type: "button" });
  button.onclick = () => {
    byId("run").close();
    state.plan = runs.method[row];
    showInstance(runs.instance[row]);
    byId("instance").scrollIntoView();
  };
  byId("run").showModal();
}

// failures
function tellFailure(place, failure) {
  add(place, "p", failure.reason || "unknown reason");
  if (failure.details) add(place, "pre", failure.details);
}
function tellFailures() {
  const place = byId("failed");
  place.replaceChildren();
  const own = page.failures.filter((one) => one.group === state.group && !state.off.has(one.method));
  const missing = group().methods.filter((one) => !state.off.has(one.method)).reduce((sum, one) => sum + one.runs - (one.outcomes.solved || 0), 0);
  const count = own.reduce((sum, one) => sum + one.runs, 0);
  if (!missing) add(place, "p", "None: every run was solved.");
  else add(place, "p", `${counted(missing, "run")} not solved, the most frequent kinds first; refusals are no faults.${missing > count ? ` ${counted(missing - count, "run")} of rarer kinds are left out, to keep the page small.` : ""}`);
  const lay = (some) => some.forEach((failure) => {
    const box = add(place, "details", "", { class: "failure" });
    add(box, "summary", `${page.labels[failure.method]}: ${failure.outcome}, ${counted(failure.runs, "run")}: ${failure.reason.split("\n")[0].slice(0, 200)}`);
    box.ontoggle = () => {
      if (box.children.length > 1) return;
      add(box, "p", `First on ${page.instances.name[failure.instance]}, seed ${failure.seed}.`, { class: "hint" });
      tellFailure(box, failure);
    };
  });
  lay(own.slice(0, 30));
  if (own.length > 30) {
    const more = add(place, "button", `${own.length - 30} more kinds`, { type: "button" });
    more.onclick = () => { more.remove(); lay(own.slice(30)); };
  }
}

function choose(index) {
  state.group = index;
  update(true);
}
function update(isOther) {
  byId("group").value = state.group;
  [...byId("conditions").tBodies[0].rows].forEach((row) => row.classList.toggle("chosen", tables.get(byId("conditions")).row(row).data()?.[0] === state.group));
  layChips();
  tellMethods();
  tellPaired();
  tellFailures();
  filterRuns();
  const first = runs && isOther ? runs.instance[runs.group.indexOf(state.group)] : state.instance;
  return drawCharts().then(() => showInstance(first >= 0 ? first : Math.max(page.instances.chunk.indexOf(0), 0)));
}
function setTheme() {
  document.documentElement.classList.toggle("dark", window.matchMedia("(prefers-color-scheme: dark)").matches);
}
async function main() {
  setTheme();
  page = JSON.parse(await unpack("main"));
  if (!page.groups.length) {
    byId("about").textContent = `${page.stores.join(", ")}; written ${page.made} by alloc ${page.version}`;
    byId("problem").hidden = false;
    document.querySelector("nav").hidden = true;
    byId("problem").textContent = "There are no completed runs yet; `alloc compare ... --store` adds some.";
    return;
  }
  byId("main").hidden = false;
  add(document.head, "style", await unpack("library-css"));
  document.head.append(document.querySelector("style")); // ours comes last
  ({ default: DataTable } = await load("library-js"));
  orderFigures();
  tellAll();
  layFigures();
  layInstances();
  await load("library-vega");
  await update(true);
  document.documentElement.dataset.ready = Math.round(performance.now()); // milliseconds until all is drawn but the table of runs
  if (page.groups.reduce((sum, one) => sum + one.conditions.runs, 0) <= SOON) await tellRuns();
  else new IntersectionObserver((entries, observer) => {
    if (!entries.some((entry) => entry.isIntersecting)) return;
    observer.disconnect();
    tellRuns();
  }, { rootMargin: "300px" }).observe(byId("runs"));
  window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
    if (window.matchMedia("print").matches) return; // paper is light, and is printed before charts could be drawn again
    setTheme();
    update(false);
  });
}
main().catch((error) => {
  byId("problem").hidden = false;
  byId("problem").textContent = `The page could not be drawn (${error}); it needs a browser of 2023 or later.`;
  throw error;
});
