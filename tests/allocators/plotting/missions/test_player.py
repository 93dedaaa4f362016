"""The page that plays a mission: its contents, and that it plays in a browser."""

import re
from pathlib import Path

import numpy as np
import pytest
from browser import needs_browser, run_in_browser

from alloc.allocators import animate_mission, simulate
from alloc.allocators.plotting import check_animation
from alloc.allocators.plotting.missions.picture import title
from alloc.allocators.plotting.missions.player import STEPS, document
from alloc.problems import Course, Event, InputError, Instance, Mission, Radio, Recorder, course_of


def rescue() -> Mission:
    """Three agents, one fails; a task that comes later and one that is missed; messages that are lost."""
    instance = Instance(
        name="rescue </script><img src=x>",
        agent_ids=["Alta", "Bodø", "<b>"],
        ability=[2, 3, 1],
        speed=[2, 2, 1],
        agent_position=[[0, 0], [4, 0], [0, 3]],
        task_ids=["north", "south", "late"],
        workload=[4, 6, 50],
        task_position=[[1, 3], [3, 0], [4, 3]],
    )
    return Mission(
        instance,
        appears=[0, 0.6, 0],
        deadline=[np.inf, np.inf, 3],
        events=[Event(1.5, "agent-fails", agent="<b>")],
        horizon=6,
        knowledge="local",
        sensing=2,
        radio=Radio(radius=2.5, loss=0.3),
    )


@pytest.fixture(scope="module")
def course() -> Course:
    recorder = Recorder(with_knowledge=True)
    run = simulate(rescue(), "greedy", observe=recorder)
    return recorder.course(run.result)


@pytest.fixture
def page(course: Course, tmp_path: Path) -> Path:
    animate_mission(course, str(tmp_path / "run.html"))
    return tmp_path / "run.html"


def test_page_is_self_contained(page: Path) -> None:
    """One file without links, whose policy forbids loading anything; names are data, never markup."""
    text = page.read_text(encoding="utf-8")
    assert re.findall(r"""\s(?:src|href)=["']?([^"'>\s]+)""", text.replace("src=x", "")) == ["data:,"]
    assert "default-src 'none'" in text
    assert "<img" not in text
    assert "<b>" not in text
    assert "Mike Bostock" in text  # the licence of the library asks for its notice


def test_page_contains_the_recorded_knowledge(course: Course) -> None:
    """Report hours are exact to one part in 65,000 of the mission; 0 means unknown."""
    import base64

    assert course.awareness is not None
    known = document(course)["knowledge"]
    assert isinstance(known, dict)
    steps = np.frombuffer(base64.b64decode(str(known["reports"])), dtype="<u2").reshape(course.awareness.reports.shape)
    recorded = course.awareness.reports
    assert ((steps == 0) == np.isnan(recorded)).all()
    assert np.nanmax(np.abs(np.where(steps == 0, np.nan, (steps - 1.0) / STEPS * course.end) - recorded)) < 1e-3
    assert np.isnan(recorded).any()


def test_agents_do_not_know_tasks_beyond_their_sensing_radius(course: Course) -> None:
    """At first an agent knows itself and what lies within 2, and no task that has not appeared."""
    assert course.awareness is not None
    first = ~np.isnan(course.awareness.reports[:, 1])  # the second moment: all have looked around
    assert first[:, :3].diagonal().all()
    assert first[:, 3:].tolist() == [[False, False, False], [False, False, False], [True, False, False]]


SCRIPT = """
<script>
{
const out = [];
const clock = () => parseFloat(document.getElementById("clock").textContent);
out.push(document.querySelector("h1").textContent, document.getElementById("summary").textContent.split("\\n").length);
out.push(clock());
const slider = document.getElementById("hour");
const before = document.getElementById("map").toDataURL();
slider.value = 2;
slider.dispatchEvent(new Event("input"));
out.push(clock(), before !== document.getElementById("map").toDataURL());
follow(2);
out.push(document.getElementById("about").textContent.split("\\n")[0], document.getElementById("knowing").hidden);
follow(0);
const truth = document.getElementById("map").toDataURL();
document.getElementById("known").click();
out.push(truth !== document.getElementById("map").toDataURL(), marks.some((mark) => mark.text.includes("as of")));
document.getElementById("speed").value = "8";
document.getElementById("play").click();
out.push(document.getElementById("play").textContent);
step(1000);
step(1500);
out.push(clock() > 2);
document.getElementById("play").click();
out.push(document.getElementById("play").textContent, document.querySelectorAll("img").length);
document.body.replaceChildren(JSON.stringify(out));
}
</script>
"""


@needs_browser
def test_page_plays_and_scrubs(page: Path, course: Course, tmp_path: Path) -> None:
    """The page has a heading, starts at hour 0, follows the slider, plays, and stops; there are no errors."""
    failed = "<b> has failed."
    heading = title(course).split("\n")[0]
    expected = [heading, 1, 0, 2, True, failed, False, True, True, "pause", True, "play", 0]
    assert run_in_browser(page, SCRIPT, tmp_path) == expected


def test_log_gives_the_same_course(course: Course) -> None:
    """The course from the log equals the recorded one, except for the knowledge of agents."""
    run = simulate(rescue(), "greedy")
    again = course_of(run.log)
    assert (again.legs, again.levels, again.messages, again.end) == (
        course.legs,
        course.levels,
        course.messages,
        course.end,
    )
    assert again.awareness is None


def test_film_is_written(course: Course, tmp_path: Path) -> None:
    """A .gif has the requested number of frames, which differ."""
    from PIL import Image, ImageChops

    animate_mission(course, str(tmp_path / "run.gif"), frames=3)
    with Image.open(tmp_path / "run.gif") as film:
        assert film.n_frames == 3
        first = film.convert("RGB")
        film.seek(2)
        assert ImageChops.difference(first, film.convert("RGB")).getbbox() is not None


def test_mp4_without_ffmpeg_is_refused_in_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    """The error says what is missing, and which format works instead."""
    monkeypatch.setenv("PATH", "")
    with pytest.raises(InputError, match=r"run\.mp4: needs the program ffmpeg, .* or write \.gif or \.html"):
        check_animation("run.mp4")


def test_other_suffixes_are_refused() -> None:
    """An animation is a page or a film."""
    with pytest.raises(InputError, match=r"run\.avi: must end in \.gif, \.mp4 or \.html"):
        check_animation("run.avi")
