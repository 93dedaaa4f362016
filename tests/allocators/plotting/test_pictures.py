"""Every kind of picture matches a small reference picture that was inspected.

Where a picture is meant to change, the failure names the new one, reduced. Look at it, and then put it in the place of
the old one.
"""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import matplotlib
import numpy as np
import pytest
from matplotlib.testing.compare import compare_images
from PIL import Image

from alloc.allocators import Fleet, Result, StopReason, TracePoint, WhatIf, plot_mission, simulate
from alloc.allocators.pareto import Front
from alloc.allocators.plotting import plot, plot_convergence, plot_front, plot_whatif
from alloc.problems import Allocation, Course, Event, Instance, Mission, Objective, Radio, Units, course_of, evaluate

KEPT = Path(__file__).parent / "pictures"

TOLERANCE = 4.0
"""Most root mean square of the differences, of 255: smoother edges are less, a wedge or bar elsewhere more."""

SMALLER = 4
"""What pictures are reduced by, each way: what is kept is of some kilobytes, and the shapes of letters hardly count."""


def planned(instance: Instance, plan: list[int], **fields: object) -> Result:
    """Return the result of a method that knows one plan."""
    allocation = Allocation(plan)
    result = Result(
        instance=instance,
        method="by hand",
        objective=Objective.MAKESPAN_ENERGY,
        seed=0,
        allocation=allocation,
        evaluation=evaluate(instance, allocation),
        lower_bound=None,
        energy_lower_bound=None,
        stop_reason=StopReason.ITERATIONS,
        runtime_s=1.0,
        trace=(),
    )
    return replace(result, **fields)  # type: ignore[arg-type]


def moves() -> Result:
    """Agents at tasks and on their own, some that move, one idle; a task that is not served."""
    instance = Instance(
        name="moves",
        ability=[5, 2, 1, 8, 3, 2],
        workload=[3, 13, 4, 5],
        task_position=[[0, 0], [2, 0.5], [0, 2], [2, 2]],
        agent_position=[[np.nan] * 2] * 3 + [[1, 1], [1.5, 1.2], [0.5, 0.3]],
        start_task=[0, 0, 1, -1, -1, -1],
        energy_per_distance=6,
    )
    return planned(instance, [1, 0, 0, 1, 2, -1], lower_bound=1.0)


def times() -> Result:
    """No positions: bars alone, one task without work, and one that is not served."""
    instance = Instance(name="times", ability=[1, 2, 4], workload=[3, 0, 5, 8])
    return planned(instance, [0, 2, 2], lower_bound=0.5)


def many() -> Result:
    """More tasks than are named: circles in four rows, bars that stand."""
    j = np.arange(80)
    instance = Instance(
        name="many",
        ability=1 + j % 3,
        workload=1 + j % 7,
        task_position=np.column_stack([j % 20, j // 20]),
        start_task=(j + 1) % 80,
    )
    return planned(instance, j.tolist(), lower_bound=2.0)


def lines() -> Result:
    """So many tasks that lines stand for them, and some that are not served."""
    j = np.arange(1200)
    instance = Instance(name="lines", ability=np.ones(1200), workload=1 + j / 100)
    return planned(instance, np.where(j < 1000, j, 0).tolist())


def bases() -> Result:
    """Bases with names, units, all tasks done together: no colour bar, and groups named in the bars."""
    instance = Instance(
        name="bases",
        agent_ids=["Alta-1", "Alta-2", "Alta-3", "Bodø-1", "Bodø-2"],
        ability=[1, 1, 1, 1, 1],
        agent_position=[[0, 0]] * 3 + [[4, 1]] * 2,
        task_ids=["north", "south"],
        workload=[4, 6],
        task_position=[[1, 3], [3, -1]],
        units=Units(time="h", distance="km", energy="kWh"),
    )
    return planned(instance, [0, 0, 1, 1, 1], lower_bound=2.0)


def returns() -> Result:
    """Agents that return elsewhere than to where they begin: dashed lines to diamonds, and to a base of others."""
    fields = {"bases": {"Alta": (0, 0), "Harbour": (5, 3)}, "return_base": [-1, 1, 1, 0, -1], "returns": [True] * 5}
    return planned(replace(bases().instance, **fields), [0, 0, 1, 1, 1], lower_bound=2.0)


def earth() -> Result:
    """Longitudes and latitudes on both sides of the date line, far north: degrees are not as long as wide."""
    instance = Instance(
        name="earth",
        ability=[1, 2, 3],
        workload=[3, 5, 8],
        agent_position=[[176, 68], [-178, 71], [-175, 66]],
        task_position=[[179, 70], [-179, 67], [-176, 69]],
        metric="geographic",
    )
    return planned(instance, [0, 1, 2], lower_bound=1.0)


def runs() -> list[Result]:
    """Two runs of one method and one of another, with energy."""
    traces = [(0.01, 4.0, 9.0), (0.1, 2.0, 10.0), (2.0, 1.5, 8.0)], [(0.02, 3.0, 7.0), (1.0, 1.25, 6.0)]
    seeds = [
        planned(
            two_sites(),
            [0, 1, 1],
            seed=seed,
            runtime_s=4.0,
            trace=tuple(TracePoint(*point) for point in trace),
            lower_bound=1.0,
        )
        for seed, trace in enumerate(traces)
    ]
    return [*seeds, replace(seeds[0], method="other", trace=(TracePoint(0.05, 2.5, 9.5), TracePoint(3.0, 1.1, 9.0)))]


def two_sites() -> Instance:
    return Instance(
        name="front",
        ability=[2, 2, 2],
        workload=[2, 4],
        task_position=[[0, 0], [1, 0]],
        start_task=[0, 0, 0],
        energy_per_distance=5,
    )


def front(*slow: float) -> Front:
    """Return a front of a plan in an hour, and of more that take these hours for less energy."""
    instance = two_sites()
    fastest = planned(instance, [0, 1, 1], lower_bound=0.8, energy_lower_bound=9.0, makespan_limit=1.0)
    assert fastest.evaluation is not None
    later = [
        replace(
            fastest,
            evaluation=replace(fastest.evaluation, makespan=hours, energy=10.0 / hours),
            energy_lower_bound=8.0 / hours,
            makespan_limit=1.1 * hours,
        )
        for hours in slow
    ]
    return Front(instance, (fastest, *later), True)


def grown(*energies: float) -> WhatIf:
    """Return an instance without an agent, where a task is unserved, as it is, and with one agent more for each."""
    instance = two_sites()
    now = planned(instance, [0, 1, 1], lower_bound=0.8)
    fleets = [Fleet((), (), now), Fleet((), ("a1",), planned(instance, [-1, 1, 1]))]
    for k, energy in enumerate(energies, 1):
        assert now.evaluation is not None
        score = replace(now.evaluation, makespan=1.2 / k, energy=energy)
        result = replace(now, evaluation=score, lower_bound=0.9 / k, energy_lower_bound=0.8 * energy)
        fleets.append(Fleet(tuple(f"a2+{step}" for step in range(1, k + 1)), ("a1",), result))
    return WhatIf(instance, ("a2",), tuple(fleets), True)


def short(*plans: list[int]) -> WhatIf:
    """Return fleets of which none serves all tasks: there is no makespan to be drawn."""
    instance = two_sites()
    fleets = [Fleet(("a4",) * k, (), planned(instance, plan)) for k, plan in enumerate(plans)]
    return WhatIf(instance, ("a1",), tuple(fleets), True)


def mission(*events: Event, loss: float = 0.3, positions: bool = True) -> Course:
    """Return a mission by sight and radio: a task comes later, one is missed, and what `events` say."""
    places = (
        {"agent_position": [[0, 0], [4, 0], [0, 3]], "task_position": [[1, 3], [3, 0], [4, 3]]} if positions else {}
    )
    instance = Instance(
        name="mission",
        ability=[2, 3, 1],
        speed=[2, 2, 1],
        workload=[4, 6, 50],
        units=Units(time="h", distance="km"),
        **places,  # type: ignore[arg-type]
    )
    run = simulate(
        Mission(
            instance,
            appears=[0, 0.6, 0],
            deadline=[np.inf, np.inf, 3],
            events=events,
            horizon=6,
            knowledge="local" if positions else "full",
            sensing=2,
            radio=Radio(radius=2.5, loss=loss),
        ),
        "greedy",
    )
    return course_of(run.log)


def fleet() -> Course:
    """Return a mission of more agents and tasks than have names."""
    j = np.arange(60)
    instance = Instance(
        name="fleet",
        ability=1 + j % 3,
        speed=np.full(60, 2.0),
        agent_position=np.column_stack([j % 10, j // 10]),
        workload=5 + j % 7,
        task_position=np.column_stack([(j * 7) % 10 + 0.5, (j * 3) % 6 + 0.5]),
    )
    return course_of(simulate(Mission(instance, appears=(j % 4) / 2), "nearest").log)


FAILURE = Event(1.5, "agent-fails", agent="a3")

DRAWN: dict[str, Callable[[str], object]] = {
    "moves": lambda path: plot(moves(), path),
    "times": lambda path: plot(times(), path),
    "many": lambda path: plot(many(), path),
    "lines": lambda path: plot(lines(), path),
    "bases": lambda path: plot(bases(), path),
    "returns": lambda path: plot(returns(), path),
    "earth": lambda path: plot(earth(), path),
    "runs": lambda path: plot_convergence(runs(), path),
    "nothing": lambda path: plot(replace(moves(), allocation=None, evaluation=None), path),
    "front": lambda path: plot_front(front(1.3, 2.0), path),
    "wide-front": lambda path: plot_front(front(2.0, 5.0, 20.0), path),
    "one-point": lambda path: plot_front(front(), path),
    "fleets": lambda path: plot_whatif(grown(6.0, 9.0), path),
    "short-fleets": lambda path: plot_whatif(short([-1, -1, -1], [-1, 1, 1]), path),
    "short-point": lambda path: plot_front(Front(two_sites(), (planned(two_sites(), [-1, 1, 1]),), True), path),
    "mission": lambda path: plot_mission(mission(FAILURE), path),
    "mission-fleet": lambda path: plot_mission(fleet(), path),
    "mission-nowhere": lambda path: plot_mission(mission(FAILURE, positions=False), path),
}


def reduced(path: Path) -> Path:
    """Reduce a picture in place, to few colours."""
    with Image.open(path) as picture:
        small = picture.convert("RGB").reduce(SMALLER)
    small.quantize(256, dither=Image.Dither.NONE).save(path, optimize=True)
    return path


def difference(name: str, path: Path) -> str | None:
    """Return what is wrong with a picture that has been reduced; nothing where it is the one that is kept."""
    return compare_images(str(KEPT / f"{name}.png"), str(path), TOLERANCE)


@pytest.mark.skipif(matplotlib.__version_info__ < (3, 11), reason="text of matplotlib before 3.11 has another size")
@pytest.mark.parametrize("name", DRAWN)
def test_picture_matches_the_reference_picture(tmp_path: Path, name: str) -> None:
    """The picture differs from the reference picture by less than a wrong one does."""
    DRAWN[name](str(tmp_path / f"{name}.png"))
    wrong = difference(name, reduced(tmp_path / f"{name}.png"))
    assert wrong is None, wrong


def test_every_reference_picture_is_drawn() -> None:
    """Every reference picture is compared with a drawn one."""
    assert {path.stem for path in KEPT.glob("*.png")} == set(DRAWN)


def one_elsewhere(result: Result, agent: int, task: int) -> Result:
    """Send one agent to another task."""
    assert result.allocation is not None
    plan = result.allocation.task_of_agent.copy()
    plan[agent] = task
    allocation = Allocation(plan)
    return replace(result, allocation=allocation, evaluation=evaluate(result.instance, allocation))


def together(instance: Instance) -> Instance:
    """Put all agents at one base."""
    return replace(instance, agent_position=[[0, 0]] * 5)


def flat(instance: Instance) -> Instance:
    """Take degrees for lengths."""
    return replace(instance, metric="euclidean")


WRONG: dict[str, tuple[str, Callable[[str], object]]] = {
    "one agent goes elsewhere": ("moves", lambda path: plot(one_elsewhere(moves(), 4, 3), path)),
    "the idle one goes too": ("moves", lambda path: plot(one_elsewhere(moves(), 5, 2), path)),
    "another task takes longer": ("times", lambda path: plot(one_elsewhere(times(), 2, 0), path)),
    "another bound": ("times", lambda path: plot(replace(times(), lower_bound=1.5), path)),
    "all stay where they are": (
        "many",
        lambda path: plot(planned(many().instance, ((np.arange(80) + 1) % 80).tolist(), lower_bound=2.0), path),
    ),
    "all on one task": ("lines", lambda path: plot(planned(lines().instance, [0] * 1200), path)),
    "all at one base": (
        "bases",
        lambda path: plot(planned(together(bases().instance), [0, 0, 1, 1, 1], lower_bound=2.0), path),
    ),
    "a plane": ("earth", lambda path: plot(planned(flat(earth().instance), [0, 1, 2], lower_bound=1.0), path)),
    "a run is missing": ("runs", lambda path: plot_convergence(runs()[:2], path)),
    "a plan after all": ("nothing", lambda path: plot(moves(), path)),
    "a point is missing": ("front", lambda path: plot_front(front(2.0), path)),
    "a point elsewhere": ("front", lambda path: plot_front(front(1.5, 2.0), path)),
    "the scale": ("wide-front", lambda path: plot_front(front(1.3, 2.0), path)),
    "another energy": ("fleets", lambda path: plot_whatif(grown(9.0, 6.0), path)),
    "home is another base": (
        "returns",
        lambda path: plot(planned(bases().instance, [0, 0, 1, 1, 1], lower_bound=2.0), path),
    ),
    "all are served": ("short-point", lambda path: plot_front(front(), path)),
    "another number unserved": ("short-fleets", lambda path: plot_whatif(short([-1, 1, 1], [-1, 1, 1]), path)),
    "nobody fails": ("mission", lambda path: plot_mission(mission(), path)),
    "nobody is heard": ("mission", lambda path: plot_mission(mission(FAILURE, loss=1.0), path)),
    "nobody fails there": ("mission-nowhere", lambda path: plot_mission(mission(positions=False), path)),
    "more than one point": ("one-point", lambda path: plot_front(front(1.3), path)),
}


@pytest.mark.slow  # all of them test the test before
@pytest.mark.parametrize("what", WRONG)
def test_wrong_picture_is_detected(tmp_path: Path, what: str) -> None:
    """A picture of another plan, bound or front does not match the reference picture."""
    name, draw = WRONG[what]
    draw(str(tmp_path / "wrong.png"))
    assert difference(name, reduced(tmp_path / "wrong.png")) is not None
