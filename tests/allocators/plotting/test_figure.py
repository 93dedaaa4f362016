import numpy as np
import pytest

from alloc.allocators import Result, solve
from alloc.allocators.conclusion import scored_result
from alloc.allocators.pareto import pareto
from alloc.allocators.plan.places import places, two_axes
from alloc.allocators.plotting import plot, plot_convergence, plot_front
from alloc.allocators.plotting.labels import place_labels, visible
from alloc.allocators.plotting.moves import flows, wedges
from alloc.allocators.plotting.times import listed
from alloc.problems import Allocation, Family, InputError, Instance, Units, random_instance


def planned(instance: Instance, plan: list[int]) -> Result:
    """Return the result with one plan."""
    return scored_result(instance, Allocation(plan))


def axes_of(instance: Instance):
    return plot(solve(instance, "greedy", handle_signals=False)).axes


def test_sites_and_times_are_drawn(small):
    """With positions there are a map and bars as long as the tasks take, the last task first."""
    result = solve(small, "greedy", handle_signals=False)
    sites, times = plot(result).axes
    widths = [bar.get_width() for bar in times.patches]
    assert widths == sorted(result.evaluation.completion_time.tolist(), reverse=True)
    assert {text.get_text() for text in sites.texts} >= {"t1", "t2", "t3"}


def test_only_times_are_drawn_without_positions():
    """An instance without positions has only bars."""
    (times,) = axes_of(Instance(ability=[1, 2], workload=[1, 0]))
    assert len(times.patches) == 2
    assert [text.get_text() for text in times.texts] == ["no work", "a1, a2"]


def test_unserved_tasks_are_hatched(unservable):
    """An unserved task has a hatched bar to the end of the axis, and an entry in the legend."""
    (times,) = axes_of(unservable)
    never, done = (bar.get_width() for bar in times.patches)
    assert never == times.get_xlim()[1] > done
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
    """Unknown or equal positions, huge coordinates and names with mathematical symbols are drawn."""
    figure = plot(solve(Instance(ability=[1, 2, 3], workload=[1, 2], **more), "greedy", handle_signals=False))
    figure.canvas.draw()
    assert figure.axes


def test_many_tasks_are_drawn_as_vertical_bars_without_names():
    """Bars are vertical beyond 40 tasks, and unlabelled beyond 60."""
    rng = np.random.default_rng(0)
    sites, times = axes_of(Instance(ability=np.ones(300), workload=np.ones(200), task_position=rng.random((200, 3))))
    assert len(times.patches) == 200
    assert len(sites.texts) == 0


def test_flows_are_grouped_by_place_and_task():
    """Agents with the same start and task are one flow; those that stay, idle or have no position are none."""
    instance = Instance(
        ability=[1] * 5,
        workload=[1, 1],
        task_position=[[0, 0], [1, 0]],
        start_task=[0, 0, 0, 1, -1],
    )
    moves = flows(places(instance), Allocation([1, 1, 0, -1, 0]))
    assert moves.count.tolist() == [2]
    assert moves.begin.tolist() == [[0, 0]]
    assert moves.end.tolist() == [[1, 0]]
    (shape,) = wedges(moves, 1.0)
    assert shape[1].tolist() == [1, 0]
    assert shape[0, 1] == -shape[2, 1] > 0


def test_two_axes_of_largest_spread_are_drawn():
    """Positions without spread along y are drawn in the other two coordinates."""
    instance = Instance(ability=[1], workload=[1, 1], task_position=[[0, 0, 0], [1, 0.1, 2]])
    assert two_axes(instance) == (0, 2)


def test_labels_do_not_overlap_each_other_or_circles():
    """A label is moved to another side or omitted; labels of large circles are placed first."""
    centre = np.array([[0.0, 0.0], [0.0, 12.0], [np.nan, np.nan]])
    radius, width = np.array([10.0, 4.0, 3.0]), np.array([10.0, 10.0, 10.0])
    middle = place_labels(centre, radius, width, 8.0, np.zeros((0, 2, 2)))
    assert middle[0].tolist() == [0, -15]
    assert middle[1].tolist() == [0, 21]
    assert np.isnan(middle[2]).all()
    assert visible(centre[:2], radius[:2], 3.0).tolist() == [True, True]
    assert visible(np.zeros((2, 2)), radius[:2], 3.0).tolist() == [False, True]


def test_labels_avoid_moves():
    """A label is placed on the first side without a move, or on that with the fewest."""
    centre, radius, width = np.zeros((1, 2)), np.array([4.0]), np.array([10.0])
    up = [[0.0, 0.0], [0.0, 60.0]]
    (below,) = place_labels(centre, radius, width, 8.0, np.array([up]))
    assert below[1] < 0
    ways = [[[0.0, 0.0], [60 * np.cos(turn), 60 * np.sin(turn)]] for turn in np.linspace(0, 2 * np.pi, 73)]
    (crowded,) = place_labels(centre, radius, width, 8.0, np.array(ways))
    assert not np.isnan(crowded).any()


def test_names_in_any_script_are_drawn_on_one_line():
    """Missing glyphs and line breaks in names do no harm: each label is one line."""
    (times,) = axes_of(Instance(name="two\nlines", task_ids=["日本", "a\nb"], ability=[1, 2], workload=[1, 2]))
    assert {label.get_text() for label in times.get_yticklabels()} == {"日本", "a b"}


def test_very_large_instances_are_drawn_by_a_sample():
    """For very large instances dots and wedges are of a sample of agents, and lines replace the bars."""
    instance = random_instance(Family(agents=30_000, tasks=1_200, starts="own"), 0)
    figure = plot(solve(instance, "greedy"))
    sites, times = figure.axes[:2]
    assert "sample of 20000 agents" in sites.get_title()
    assert len(sites.collections[0].get_offsets()) <= 20_000
    assert not times.patches


@pytest.mark.parametrize("suffix", ["png", "svg", "pdf"])
def test_plot_writes_the_figure_that_it_returns(small, tmp_path, suffix):
    """With a path the figure is also written, and figures made by pyplot are not affected."""
    from matplotlib import pyplot

    before = pyplot.get_fignums()
    path = tmp_path / f"picture.{suffix}"
    figure = plot(solve(small, "greedy", handle_signals=False), str(path))
    assert len(figure.axes) == 2
    assert path.stat().st_size > 5_000
    assert pyplot.get_fignums() == before


def test_other_suffixes_are_refused_before_drawing(small, tmp_path):
    """Only picture formats are written; the error names the file, and no file is left behind."""
    with pytest.raises(InputError, match=r"picture\.gif: must end in \.png, \.svg or \.pdf"):
        plot(solve(small, "greedy", handle_signals=False), str(tmp_path / "picture.gif"))
    assert not (tmp_path / "picture.gif").exists()


def test_a_front_is_drawn_as_steps_with_its_bounds(small):
    """`plot_front` returns a figure with the points found and the region that is proven infeasible."""
    front = pareto(small, "milp", points=3, iterations=50, handle_signals=False)
    (axes,) = plot_front(front).axes
    assert axes.lines[1].get_xdata().tolist() == [result.makespan for result in front.points]
    assert {"best found", "proven infeasible"} == {text.get_text() for text in axes.get_legend().get_texts()}


def legend(axes):
    return [text.get_text() for text in axes.get_legend().get_texts()]


def fleet(**more):
    """Three agents at a base, one at another place, and two tasks, one of them long."""
    fields = {
        "name": "fleet",
        "agent_ids": ["north-1", "north-2", "north-3", "west"],
        "ability": [1, 1, 1, 1],
        "agent_position": [[0, 4], [0, 4], [0, 4], [-3, 0]],
        "task_ids": ["bridge", "dam"],
        "workload": [2, 4],
        "task_position": [[0, 0], [3, 2]],
    }
    return Instance(**{**fields, **more})


def test_bases_are_named_with_counts():
    """Agents with one start are one square with the common part of their ids; a single agent has its own name."""
    sites, _ = axes_of(fleet())
    names = {text.get_text() for text in sites.texts}
    assert {"north (3)", "west", "bridge", "dam"} <= names
    assert legend(sites) == [
        "task; area: workload, number: agents",
        "base (number of agents)",
        "start of a single agent",
        "move, tapering to the task",
    ]


def test_unnamed_bases_list_few_agents():
    """If ids have no common part, a base of a small fleet lists its agents, one of a large fleet has a number."""
    sites, _ = axes_of(fleet(agent_ids=["ann", "ben", "cid", "dan"]))
    assert "ann, ben, cid" in {text.get_text() for text in sites.texts}
    many = Instance(
        ability=np.ones(40),
        workload=[1, 2],
        agent_position=[[0, 0]] * 20 + [[5, 5]] * 20,
        task_position=[[0, 5], [5, 0]],
    )
    assert {"base 1 (20)", "base 2 (20)"} <= {text.get_text() for text in axes_of(many)[0].texts}


def test_bars_name_their_groups():
    """Each bar names the group of its task."""
    _, times = plot(planned(fleet(), [0, 1, 1, 0])).axes
    assert {text.get_text() for text in times.texts} == {"north-1, west", "north-2, north-3"}


@pytest.mark.parametrize(
    ("longest", "text"), [(30, "ann, ben, cid, dora"), (15, "ann and 3 more"), (12, "4 agents"), (5, "")]
)
def test_group_labels_fit_their_bars(longest, text):
    """A bar has as many names as fit, else the number of agents, else nothing."""
    assert listed(["ann", "ben", "cid", "dora"], longest) == text


def test_units_are_on_the_axes():
    """Unit labels are on the axes and in the title, and absent if the instance has none."""
    sites, times = axes_of(fleet(units=Units(time="min", distance="km", energy="kWh")))
    assert (sites.get_xlabel(), sites.get_ylabel()) == ("x (km)", "y (km)")
    assert times.get_xlabel() == "completion time (min)"
    assert " min, gap" in sites.figure.get_suptitle()
    assert " kWh" in sites.figure.get_suptitle()
    sites, times = axes_of(fleet())
    assert (sites.get_xlabel(), times.get_xlabel()) == ("x", "completion time")


def test_colour_bar_is_drawn_if_times_differ():
    """There is a colour bar if completion times differ, and none otherwise."""
    scales = [plot(planned(fleet(), plan)).axes[0].child_axes for plan in ([0, 1, 1, 1], [0, 1, 1, -1])]
    assert [len(found) for found in scales] == [1, 0]


def test_geographic_maps_keep_their_shape():
    """At 60 degrees north a degree of latitude is drawn twice as long as one of longitude, also at the date line."""
    instance = fleet(
        metric="geographic",
        agent_position=[[179, 60]] * 3 + [[-179, 59.5]],
        task_position=[[179.5, 60.5], [-179.5, 60]],
    )
    sites, _ = axes_of(instance)
    assert sites.get_aspect() == pytest.approx(2, rel=0.02)
    assert sites.get_xlabel() == "longitude (°)"
    low, high = sites.get_xlim()
    assert 178 < low < high < 182.5
    assert sites.xaxis.get_major_formatter()(181) == "-179"


def test_long_names_remain_distinct():
    """Names with the same beginning are not shortened to the same label."""
    ids = [f"inspection of the southern pylon {number}" for number in (1, 2)]
    _, times = axes_of(fleet(task_ids=ids))
    labels = [label.get_text() for label in times.get_yticklabels()]
    assert len(set(labels)) == 2
    assert all(len(label) <= 18 for label in labels)


def test_runs_are_drawn_over_time(small):
    """Each run is a line down to its makespan, above the best bound of all; energy has its own panel."""
    runs = [solve(small, "ga", seed=seed, iterations=5, handle_signals=False) for seed in (0, 1)]
    (axes,) = plot_convergence(runs).axes
    assert legend(axes) == ["ga, seed 0", "ga, seed 1", "best lower bound"]
    assert axes.lines[0].get_ydata()[-1] == runs[0].makespan
    both = solve(small, "greedy", objective="makespan-energy", handle_signals=False)
    assert [axes.get_ylabel() for axes in plot_convergence([*runs, both]).axes] == ["makespan", "energy"]
    assert len(plot_convergence(both).axes) == 2


def test_runs_on_several_instances_are_refused(small):
    """As there is one axis of makespans, runs of different instances, or none, are an error."""
    other = solve(fleet(), "greedy", handle_signals=False)
    with pytest.raises(InputError, match="results: must be on one instance"):
        plot_convergence([other, solve(small, "greedy", handle_signals=False)])
    with pytest.raises(InputError, match="results: must contain"):
        plot_convergence([])
