"""The page of a report in a browser: drawing, sorting, filtering and zooming, also in dark mode and on a phone."""

import shutil

import pytest
from browser import needs_browser, run_in_browser
from stored_runs import ANGRY, fill

from alloc.allocators import report_html

pytestmark = [
    pytest.mark.slow,
    needs_browser,
    pytest.mark.needs("jinja2"),
    pytest.mark.needs("itables"),
    pytest.mark.needs("vl_convert"),
]

SCRIPT = """<script>(async () => {
  const pause = () => new Promise((done) => setTimeout(done, 20));
  const until = async (test) => { while (!test()) await pause(); };
  const cells = (table, column) => [...byId(table).tBodies[0].rows].map((row) => row.cells[column].textContent);
  const type = (index, words) => {
    const input = byId("all").tHead.querySelectorAll("input")[index];
    input.value = words;
    input.dispatchEvent(new Event("input"));
    return new Promise((done) => setTimeout(done, 300));
  };
  await until(() => document.documentElement.dataset.ready || !byId("problem").hidden);
  if (STEPS) {
    byId("runs").scrollIntoView();
    await until(() => runs);
    await pause();
  }
  const found = { problem: byId("problem").textContent, dark: isDark(), images: document.images.length,
    charts: Object.fromEntries(CHARTS.map(({ id }) => {
      const chart = byId(`chart-${id}`)?.querySelector(".chart");
      return [id, chart?.querySelector("svg") ? "drawn" : chart?.textContent];
    })),
    overflow: document.documentElement.scrollWidth - window.innerWidth };
  if (STEPS) {
    Object.assign(found, { methods: cells("summary", 0), names: [...new Set(cells("all", 0))] });
    const title = [...byId("all").tHead.rows[0].cells].find((cell) => cell.textContent === "T");
    const at = [...title.parentNode.cells].indexOf(title);
    const click = () => tables.get(byId("all")).order([at, found.up ? "desc" : "asc"]).draw();
    click();
    found.up = cells("all", at);
    click();
    found.down = cells("all", at);
    await type(at, ">= 1.2");
    found.high = cells("all", at);
    await type(at, "none");
    found.none = cells("all", at).length;
    await type(at, "");
    await type(0, "i3");
    found.i3 = cells("all", 0);
    await type(0, "");
    byId("chips").querySelectorAll("button")[0].click();
    await until(() => byId("summary").tBodies[0].rows.length === 2);
    found.without = cells("summary", 0);
    await pause();
    found.rowsWithout = tables.get(byId("all")).rows({ search: "applied" }).count();
    byId("chips").querySelectorAll("button")[0].click();
    await new Promise((done) => setTimeout(done, 2000));
    const labels = () => [...byId("place").querySelectorAll(".role-axis-label text")];
    const ticks = () => labels().map((label) => label.textContent).sort();
    const whole = ticks();
    byId("in").click();
    await until(() => String(ticks()) !== String(whole));
    found.zoomed = true;
    byId("fit").click();
    await until(() => String(ticks()) === String(whole));
    found.sites = byId("place").querySelectorAll(".mark-symbol path").length;
    found.groups = [...byId("groups").querySelectorAll("tbody tr")].map((row) => row.lastChild.textContent);
    const kept = tables.size;
    const note = () => { found.finalized = true; };
    byId("paired").querySelectorAll(".chart").forEach((chart) => { chart.drawn.finalize = note; });
    tellPaired();
    found.more = tables.size - kept;
    const real = unpack;
    unpack = async (id) => { unpack = real; await new Promise((done) => setTimeout(done, 500)); return real(id); };
    await Promise.all([showInstance(0), showInstance(1)]);
    found.latest = [state.instance, byId("size").textContent.split(":")[0]];
    group().methods.forEach(({ method }) => state.off.add(method));
    await showInstance(1);
    found.off = byId("place").querySelector(".none").textContent;
    state.off.clear();
    byId("failed").querySelectorAll("details").forEach((one) => { one.open = true; });
    await until(() => byId("failed").querySelector("pre"));
    found.traceback = byId("failed").querySelector("pre").textContent;
    byId("all").tBodies[0].rows[0].cells[0].click();
    found.dialog = byId("run").open;
    found.images += document.images.length;
  }
  document.body.textContent = JSON.stringify(found);
})();</script>"""
STEPPED, LOADED = SCRIPT.replace("STEPS", "true"), SCRIPT.replace("STEPS", "false")

PATIENT = "--virtual-time-budget=60000"
DARK = "--blink-settings=preferredColorScheme=0"
DRAWN = dict.fromkeys(("profiles", "targets", "distance", "tradeoff", "scaling", "gaps", "outcomes"), "drawn")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    made = tmp_path_factory.mktemp("pages")
    fill(made / "runs.db")
    report_html([made / "runs.db"], made / "whole.html")
    return made


def looked_at(folder, tmp_path, script, size, *flags):
    shutil.copy(folder / "whole.html", tmp_path / "page.html")
    return run_in_browser(tmp_path / "page.html", script, tmp_path, size, [PATIENT, *flags])


def test_page_sorts_filters_and_zooms(folder, tmp_path):
    """Rows are sorted with missing values last; filters accept text and comparisons; stored data are shown as text."""
    found = looked_at(folder, tmp_path, STEPPED, "1200,800")
    assert found["charts"] == DRAWN
    assert (found["dark"], found["images"], found["problem"]) == (False, 0, "")
    assert found["methods"] == ["greedy", "ga[population=4]", "hedonic"]
    assert ANGRY in found["names"]
    assert found["up"] == ["1"] * 8 + ["1.5"] * 7 + ["-"] * 9
    assert found["down"] == ["1.5"] * 7 + ["1"] * 8 + ["-"] * 9
    assert (found["high"], found["none"], found["i3"]) == (["1.5"] * 7, 9, ["i3"] * 6)
    assert (found["without"], found["rowsWithout"]) == (["ga[population=4]", "hedonic"], 16)
    assert found["zoomed"]
    assert found["sites"] >= 4
    assert found["groups"] == ["a1, a2", "a3"]
    assert found["traceback"] == f"Traceback\n{ANGRY}"
    assert (found["more"], found["finalized"]) == (0, True)  # tables and charts that are made anew replace others
    assert "deselected above" in found["off"]
    assert found["latest"] == [1, "i1"]  # though what the first one waited for came later
    assert found["dialog"]


@pytest.mark.parametrize(("size", "flags"), [("500,900", []), ("1200,800", [DARK])])
def test_page_supports_phones_and_dark_mode(folder, tmp_path, size, flags):
    """All charts are drawn, nothing is wider than the screen, and the page follows the system's dark mode."""
    found = looked_at(folder, tmp_path, LOADED, size, *flags)
    assert found["charts"] == DRAWN
    assert found["dark"] == (DARK in flags)
    assert found["overflow"] <= 0


def test_page_with_little_data_says_so(tmp_path):
    """Without runs there is one sentence; of failures alone, each chart of scores says why it is empty."""
    (tmp_path / "none.db").write_bytes(b"")
    report_html([tmp_path / "none.db"], tmp_path / "none.html")
    found = run_in_browser(tmp_path / "none.html", LOADED, tmp_path, flags=[PATIENT])
    assert found["problem"].startswith("There are no completed runs")
    fill(tmp_path / "runs.db", methods=["hedonic"])
    report_html([tmp_path / "runs.db"], tmp_path / "page.html")
    found = run_in_browser(tmp_path / "page.html", LOADED, tmp_path, flags=[PATIENT])
    assert found["charts"].pop("outcomes") == "drawn"
    assert all(text.startswith("There is nothing to draw") for text in found["charts"].values())
