"""The map of a mission: labels are next to their positions and within the map."""

import numpy as np
from matplotlib.figure import Figure

from alloc.allocators import simulate
from alloc.allocators.plotting.missions.map import name_tasks, plane_of, prepare
from alloc.problems import Instance, Mission, Recorder


def test_labels_do_not_cross_the_frame() -> None:
    """The label of a large task at the upper edge is below or beside it, not across the frame."""
    instance = Instance(
        ability=[1],
        agent_position=[[0, 0]],
        task_position=[[1, 3], [0, 1.5], [2, 0]],
        workload=[9, 1, 1],
    )
    recorder = Recorder()
    course = recorder.course(simulate(Mission(instance), "nearest", observe=recorder).result)
    axes = Figure(figsize=(3, 3)).add_axes((0.1, 0.1, 0.8, 0.8))
    prepare(axes, course, plane_of(instance))
    axes.set_ylim(0, 3.3)
    name_tasks(axes, course, plane_of(instance))
    corners = [text.get_window_extent().get_points() for text in axes.texts]
    low, high = axes.bbox.get_points()
    assert len(corners) == 3
    assert all(np.all(box[0] >= low) and np.all(box[1] <= high) for box in corners)
