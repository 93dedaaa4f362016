"""The page with the map: its contents, and its rendering in a browser."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from browser import needs_browser, run_in_browser

from alloc.allocators import Result, write_result
from alloc.allocators.conclusion import scored_result
from alloc.allocators.plan.map import document
from alloc.problems import Allocation, Instance


def harbour(**more: object) -> Instance:
    """Four agents, two of them at one base and one at a task, and three tasks, one of which is not served."""
    fields: dict[str, object] = {
        "name": "harbour </script><b>$PLAN",
        "agent_ids": ["pier-1", "pier-2", "tug", "<img src=x>"],
        "ability": [1, 2, 1, 1],
        "workload": [2, 4, 1],
        "agent_position": [[0, 0], [0, 0], [np.nan, np.nan], [4, 4]],
        "start_task": [-1, -1, 1, -1],
        "task_position": [[1, 0], [0, 3], [4, 0]],
    }
    return Instance(**{**fields, **more})  # type: ignore[arg-type]


def planned(instance: Instance, plan: list[int]) -> Result:
    return scored_result(instance, Allocation(plan))


@pytest.fixture
def page(tmp_path: Path) -> Path:
    write_result(planned(harbour(), [0, 1, 1, -1]), tmp_path / "plan.html")
    return tmp_path / "plan.html"


def test_page_is_self_contained(page: Path) -> None:
    """One file without links, whose policy forbids loading anything; names are data, never markup."""
    text = page.read_text(encoding="utf-8")
    assert re.findall(r"""(?:src|href)=["']?([^"'>\\s]+)""", text.replace("src=x", "")) == ["data:,"]
    assert "default-src 'none'" in text
    assert text.count("<script") == text.count("</script>") == 2
    assert "<img" not in text
    embedded = re.search(r'<script type="application/json" id="plan">(.*?)</script>', text, re.DOTALL)
    assert embedded is not None
    assert json.loads(embedded[1]) == json.loads(json.dumps(document(planned(harbour(), [0, 1, 1, -1]))))


def test_page_contains_the_plan() -> None:
    """Positions are scaled to 0 to 1000, with the south below; bases have names, and figures have headings."""
    plan = document(planned(harbour(), [0, 1, 1, -1]))
    tasks, agents, bases = (plan[name] for name in ("tasks", "agents", "bases"))
    assert [task["place"] for task in tasks] == [[250, 1000], [0, 250], [1000, 1000]]
    assert [(base["name"], base["task"]) for base in bases] == [("pier", None), ("t2", 1), ("<img src=x>", None)]
    assert [agent["task"] for agent in agents] == [0, 1, 1, -1]
    assert [agent["base"] for agent in agents] == [0, 0, 1, 2]
    assert [task["unserved"] for task in tasks] == [False, False, True]
    assert plan["taskHeadings"] == ["task", "workload", "finish", "agents"]
    assert tasks[1]["cells"] == ["t2", "4", "1.333", "2"]


def test_equal_times_have_one_shade() -> None:
    """If all tasks finish together, none is drawn as late."""
    plan = document(planned(harbour(workload=[1, 3, 1]), [0, 1, 1, 2]))
    assert [task["late"] for task in plan["tasks"]] == [None] * 3


SCRIPT = """
<script>
const out = [];
const count = (what) => document.querySelectorAll(what).length;
const shown = () => count("#moves path:not(.hidden)");
out.push(count("#moves path"), count("#starts g"), count("#sites g"), count("#tasks li"));
const before = document.getElementById("moving").getAttribute("transform");
document.getElementById("in").click();
out.push(before !== document.getElementById("moving").getAttribute("transform"));
document.getElementById("none").click();
out.push(shown(), count("#agents tbody tr"));
document.querySelector("#tasks input").click();
out.push(shown(), count("#agents tbody tr"));
document.getElementById("all").click();
const search = document.getElementById("search");
search.value = "tug";
search.dispatchEvent(new Event("input"));
out.push(shown(), count("#agents tbody tr"));
search.value = "";
search.dispatchEvent(new Event("input"));
document.getElementById("fit").click();
document.querySelector("#sites g").dispatchEvent(new PointerEvent("pointerenter", { clientX: 9, clientY: 9 }));
out.push(document.getElementById("hover").textContent.split("\\n")[0], count("#labels text"), count("img"));
document.body.replaceChildren(JSON.stringify(out));
</script>
"""


@needs_browser
def test_page_zooms_filters_and_shows_names(page: Path, tmp_path: Path) -> None:
    """Two moves, two bases, three tasks; zooming moves them, filters and search hide them, hovering names them."""
    assert run_in_browser(page, SCRIPT, tmp_path) == [2, 2, 3, 3, True, 0, 1, 1, 2, 0, 1, "task: t2", 5, 0]


LOOK = """
<script>
const height = (what) => document.querySelector(what).getBoundingClientRect().height;
const colour = (what, name) => getComputedStyle(document.querySelector(what))[name];
const scale = Number(/scale\\(([^)]+)/.exec(document.getElementById("moving").getAttribute("transform"))[1]);
const axis = [...document.querySelectorAll("#grid text")].at(-2).getBoundingClientRect();
const isFree = document.getElementById("legend").getBoundingClientRect().bottom <= axis.top;
const fits = document.documentElement.scrollWidth <= innerWidth && isFree;
const found = [height("#map") / innerHeight > 0.6, scale * 1000 > 300, fits];
const colours = [colour("body", "color"), colour("#search", "color"), colour("#labels text", "fill")];
document.body.replaceChildren(JSON.stringify([...found, colour("#map", "backgroundColor"), ...new Set(colours)]));
</script>
"""
WHITE, BLACK = "rgb(255, 255, 255)", "rgb(34, 34, 34)"


@needs_browser
@pytest.mark.parametrize(
    ("size", "flags", "colours"),
    [("500,900", [], [WHITE, BLACK]), ("1200,800", ["--force-dark-mode"], ["rgb(20, 24, 28)", "rgb(230, 233, 236)"])],
)
def test_map_is_legible_on_phones_and_in_dark_mode(
    page: Path, tmp_path: Path, size: str, flags: list[str], colours: list[str]
) -> None:
    """The map takes most of the height, fits the width, avoids the legend, and all text has enough contrast."""
    assert run_in_browser(page, LOOK, tmp_path, size, flags) == [True, True, True, *colours]
