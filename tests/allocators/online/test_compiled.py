"""The compiled simulation does what the reference does, event by event."""

import numpy as np
import pytest

from alloc.allocators import RefusedError, simulate
from alloc.allocators.online.compiled.arrays import ARRIVED, COMPLETED, LOGGED, MISSED_IT, ORDERED, PLACE, STAY
from alloc.allocators.online.compiled.policies import NEAREST
from alloc.allocators.online.compiled.run import run_compiled
from alloc.problems import Burst, Event, Instance, Mission, MissionParameters, Pace, Radio, random_mission
from alloc.problems.vocabulary import Knowledge

FAMILIES = ("steady", "failures", "recharging", "growth", "deadlines")
KINDS = {"order": ORDERED, "arrival": ARRIVED, "completion": COMPLETED, "missed": MISSED_IT}


def rows_of(run, mission):
    """Return orders, arrivals, completions and misses of a log as rows of numbers."""
    agents, tasks = mission.instance.agent_index, mission.instance.task_index
    rows = []
    for record in run.log.records:
        if record["record"] in KINDS:
            task = tasks.get(record.get("task"), -1)
            if record["record"] == "order" and task < 0:
                task = PLACE if "position" in record else STAY
            rows.append((record["hour"], KINDS[record["record"]], agents.get(record.get("agent"), -1), task))
    return np.array(rows)


def with_changes(mission):
    """Return a mission with events of the kinds that its family does not have."""
    events = [
        *mission.events,
        Event(3.0, "task-changes", task="t1", workload=4.0),
        Event(4.0, "task-changes", task="t2", workload=0.0),
        Event(5.0, "task-cancelled", task="t3"),
        Event(6.0, "agent-recalled", agent="a1"),
        Event(7.0, "agent-returns", agent="a1"),
    ]
    fields = {name: getattr(mission, name) for name in ("joins", "appears", "deadline", "growth", "horizon", "sensing")}
    return Mission(
        mission.instance, events=events, knowledge=mission.knowledge, radio=mission.radio, seed=mission.seed, **fields
    )


@pytest.mark.slow
@pytest.mark.parametrize("knowledge", Knowledge)
@pytest.mark.parametrize("family", FAMILIES)
def test_both_simulations_have_the_same_course(family, knowledge):
    """Each order, arrival and completion is of the same agent and task at the same hour, and the measures are equal."""
    missions = [random_mission(MissionParameters(family=family, agents=4, tasks=7), seed) for seed in range(2)]
    if family == "steady":
        missions[1] = with_changes(missions[1])
    for seed, mission in enumerate(missions):
        run = simulate(mission, "nearest", knowledge=knowledge, seed=seed)
        fast, state = run_compiled(mission, NEAREST, knowledge=knowledge, seed=seed, rows=5000)
        np.testing.assert_allclose(state.log[: state.counts[LOGGED]], rows_of(run, mission), rtol=1e-9)
        result = run.result
        assert (fast.switches, fast.messages) == (result.switches, result.messages)
        assert fast.priority_done_share == result.priority_done_share
        for name in ("mission_time", "energy", "distance"):
            assert getattr(fast, name) == pytest.approx(getattr(result, name), rel=1e-9), name


@pytest.mark.parametrize(
    ("fields", "told"),
    [
        ({"pace": Pace(1, 2)}, "a pace"),
        ({"radio": Radio(delay=1.0)}, "bursts and delays"),
        ({"radio": Radio(burst=Burst(1, 1))}, "bursts and delays"),
        ({"events": [Event(1, "radio-silent", agent="a1", until=2)]}, "silence"),
        ({"instance": Instance(ability=[1], workload=[1])}, "unknown places"),
        ({"instance": Instance(ability=[1], workload=[1], metric="manhattan")}, "distances other than euclidean"),
    ],
)
def test_what_the_compiled_simulation_lacks_is_refused(fields, told):
    """A mission with what it does not have is refused with the reason."""
    place = [[0, 0]]
    base = {"instance": Instance(ability=[1], workload=[1], agent_position=place, task_position=place)}
    with pytest.raises(RefusedError, match=told):
        run_compiled(Mission(**{**base, **fields}), NEAREST)
