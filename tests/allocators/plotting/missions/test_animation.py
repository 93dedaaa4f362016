"""Single frames of a film."""

import numpy as np
from matplotlib.figure import Figure

from alloc.allocators import simulate
from alloc.allocators.plotting.missions.animation import draw_animation
from alloc.allocators.plotting.missions.map import plane_of
from alloc.problems import MissionParameters, Recorder, random_mission
from alloc.problems.missions.events import EventKind


def test_frame_shows_the_state_at_its_hour() -> None:
    """A task has a name from its appearance on; a failed agent is a cross instead of a square."""
    mission = random_mission(MissionParameters(family="failures", agents=6, tasks=10), seed=3)
    recorder = Recorder()
    course = recorder.course(simulate(mission, "nearest", deadline_ms=None, observe=recorder).result)
    figure = Figure(figsize=(6, 5))
    show = draw_animation(figure, course, plane_of(mission.instance), np.array([0.0, course.end]))
    axes = figure.axes[0]
    names = {text.get_text(): text for text in axes.texts}
    *_, squares, crosses = axes.collections
    failed = {str(event.agent) for event in mission.events if event.kind is EventKind.AGENT_FAILS}
    assert failed

    show(0)
    later = {task for task, hour in zip(mission.instance.task_ids, mission.appears, strict=True) if hour > 0}
    assert later
    assert {task for task in later if names[task].get_visible()} == set()
    assert np.isnan(crosses.get_offsets()).all()
    show(1)
    assert all(names[task].get_visible() for task in later)
    assert (~np.isnan(crosses.get_offsets()[:, 0])).sum() == len(failed)
    assert np.isnan(squares.get_offsets()[:, 0]).sum() == len(failed)
