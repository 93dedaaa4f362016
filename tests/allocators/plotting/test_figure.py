import numpy as np
import pytest

from alloc.allocators import solve
from alloc.allocators.pareto import pareto
from alloc.allocators.plotting import plot, plot_front
from alloc.allocators.plotting.labels import place_labels, visible
from alloc.allocators.plotting.moves import flows, two_axes, wedges
from alloc.problems import Allocation, Family, InputError, Instance, random_instance


def axes_of(instance: Instance):
    return plot(solve(instance, "greedy", handle_signals=False)).axes


def test_sites_and_times_are_drawn(small):
    """With positions there are sites, times and a colour scale; bars are as long as the tasks take, the last first."""
    result = solve(small, "greedy", handle_signals=False)
    sites, times, _ = plot(result).axes
    widths = [bar.get_width() for bar in times.patches]
    assert widths == sorted(result.evaluation.completion_time.tolist(), reverse=True)
    assert {text.get_text() for text in sites.texts} >= {"t1", "t2", "t3"}


def test_without_positions_times_alone_are_drawn():
    """An instance that knows no places has bars only."""
    (times,) = axes_of(Instance(ability=[1, 2], workload=[1, 0]))
    assert len(times.patches) == 2
    assert [text.get_text() for text in times.texts] == ["no work"]


def test_unserved_tasks_are_hatched(unservable):
    """An unserved task has a hatched bar, and the legend says what that means."""
    (times,) = axes_of(unservable)
    assert [bar.get_hatch() for bar in times.patches] == ["////", None]
    assert "unserved" in [text.get_text() for text in times.get_legend().get_texts()]


@pytest.mark.parametrize(
    "more",
    [
        {"task_position": [[0, 0], [np.nan, np.nan]]},
        {"task_position": [[1, 1], [1, 1]]},
        {"task_position": [[0, 0], [1e9, 1]], "agent_position": [[5, 5], [np.nan, np.nan], [0, 0]]},
        {"task_ids": ["$x^2$ and a name that is very long", "\N{SNOWMAN}"], "task_position": [[0, 0], [1, 0]]},
        {"name": "$\\frac{", "task_position": [[0, 0], [1, 0]]},
    ],
)
def test_odd_instances_are_drawn(more):
    """Unknown or equal places, huge worlds and names that look like mathematics do no harm."""
    figure = plot(solve(Instance(ability=[1, 2, 3], workload=[1, 2], **more), "greedy", handle_signals=False))
    figure.canvas.draw()
    assert figure.axes


def test_many_tasks_are_drawn_upright_without_names():
    """Beyond 40 tasks the bars stand, and beyond 60 nothing is named."""
    rng = np.random.default_rng(0)
    sites, times, _ = axes_of(Instance(ability=np.ones(300), workload=np.ones(200), task_position=rng.random((200, 3))))
    assert len(times.patches) == 200
    assert len(sites.texts) == 0


def test_flows_are_gathered_by_place_and_task():
    """Agents with the same way are one flow; who stays, is idle or comes from nowhere is none."""
    instance = Instance(
        ability=[1] * 5,
        workload=[1, 1],
        task_position=[[0, 0], [1, 0]],
        start_task=[0, 0, 0, 1, -1],
    )
    moves = flows(instance, Allocation([1, 1, 0, -1, 0]))
    assert moves.count.tolist() == [2]
    assert moves.begin.tolist() == [[0, 0, 0]]
    assert moves.end.tolist() == [[1, 0, 0]]
    (shape,) = wedges(moves, (0, 1), 1.0)
    assert shape[1].tolist() == [1, 0]
    assert shape[0, 1] == -shape[2, 1] > 0


def test_the_two_axes_spread_the_most():
    """A world that is flat along y is seen from that side."""
    instance = Instance(ability=[1], workload=[1, 1], task_position=[[0, 0, 0], [1, 0.1, 2]])
    assert two_axes(instance) == (0, 2)


def test_labels_keep_clear_of_each_other_and_of_circles():
    """A name goes to another side, or is left out, rather than cover anything; the largest circle chooses first."""
    centre = np.array([[0.0, 0.0], [0.0, 12.0], [np.nan, np.nan]])
    radius, width = np.array([10.0, 4.0, 3.0]), np.array([10.0, 10.0, 10.0])
    middle = place_labels(centre, radius, width, 8.0)
    assert middle[0].tolist() == [0, -15]
    assert middle[1].tolist() == [0, 21]
    assert np.isnan(middle[2]).all()
    assert visible(centre[:2], radius[:2], 3.0).tolist() == [True, True]
    assert visible(np.zeros((2, 2)), radius[:2], 3.0).tolist() == [False, True]


def test_names_of_every_script_on_one_line():
    """Glyphs that the font lacks and line breaks in names harm nothing: each label is one line."""
    (times,) = axes_of(Instance(name="two\nlines", task_ids=["日本", "a\nb"], ability=[1, 2], workload=[1, 2]))
    assert {label.get_text() for label in times.get_yticklabels()} == {"日本", "a b"}


def test_very_many_agents_and_tasks_are_drawn_by_a_sample():
    """Beyond what can be told apart on paper, dots and wedges are of some agents, and lines stand for the tasks."""
    instance = random_instance(Family(agents=30_000, tasks=1_200, starts="own"), 0)
    figure = plot(solve(instance, "greedy"))
    sites, times = figure.axes[:2]
    assert "20000 of the agents" in sites.get_title()
    assert len(sites.collections[0].get_offsets()) <= 20_000
    assert not times.patches


@pytest.mark.parametrize("suffix", ["png", "svg"])
def test_plot_writes_the_figure_that_it_returns(small, tmp_path, suffix):
    """With a path the drawing is written too, and figures made by pyplot stay as they are."""
    from matplotlib import pyplot

    before = pyplot.get_fignums()
    path = tmp_path / f"picture.{suffix}"
    figure = plot(solve(small, "greedy", handle_signals=False), str(path))
    assert len(figure.axes) == 3
    assert path.stat().st_size > 5_000
    assert pyplot.get_fignums() == before


def test_other_suffixes_are_refused_before_drawing(small, tmp_path):
    """Only .png and .svg are written; the error names the file, and nothing is left behind."""
    with pytest.raises(InputError, match=r"picture\.gif: must end in \.png or \.svg"):
        plot(solve(small, "greedy", handle_signals=False), str(tmp_path / "picture.gif"))
    assert not (tmp_path / "picture.gif").exists()


def test_a_front_is_drawn_as_steps_with_its_bounds(small):
    """The public verb for fronts returns a figure with the points found and the region proven impossible."""
    front = pareto(small, "milp", points=3, iterations=50, handle_signals=False)
    (axes,) = plot_front(front).axes
    assert axes.lines[1].get_xdata().tolist() == [result.makespan for result in front.points]
    assert {"best found", "proven impossible"} == {text.get_text() for text in axes.get_legend().get_texts()}
