"""Objects passed to a policy contain nothing that it must not know, at any depth."""

from types import MappingProxyType

import pytest

from alloc.allocators import AgentDecider, Policy, PolicyInfo, simulate
from alloc.allocators.online.policies.simple import Nearest
from alloc.problems import Event, MissionParameters, random_mission
from alloc.problems.missions.mission import Mission
from alloc.problems.vocabulary import Knowledge


def everything_in(found, *values):
    """Collect all strings, numbers and positions in some values, through containers and private attributes."""
    seen, left = set(), list(values)
    while left:
        value = left.pop()
        if isinstance(value, str | int | float):
            found.add(value)
            continue
        if id(value) in seen or value is None or isinstance(value, type) or callable(value):
            continue
        seen.add(id(value))
        if isinstance(value, dict | MappingProxyType):
            left += [*value.keys(), *value.values()]
        elif isinstance(value, list | tuple | set | frozenset):
            left += value
        left += vars(value).values() if hasattr(value, "__dict__") else ()
        left += (getattr(value, name) for name in getattr(type(value), "__slots__", ()) if hasattr(value, name))
    return found


class Searching(Policy):
    """Takes the nearest task; searches everything that it is passed for what it must not know."""

    info = PolicyInfo(name="searching", summary="looks for leaks")

    def __init__(self, mission):
        self.secrets = {
            name: {name, *mission.instance.task_position[task, :2].tolist(), float(mission.instance.workload[task])}
            for task, name in enumerate(mission.instance.task_ids)
        }
        self.failures = {event.hour for event in mission.events}
        self.leaks, self.unknown = set(), 0

    def begin(self, briefing):
        nearest, policy = Nearest().begin(briefing), self

        class Decider(AgentDecider):
            def decide(self, view):
                found = everything_in(set(), view, briefing)
                hidden = set(policy.secrets) - set(view.tasks)
                policy.unknown += len(hidden)
                policy.leaks |= {one for name in hidden for one in policy.secrets[name] if one in found}
                policy.leaks |= {hour for hour in policy.failures if hour > view.hour and hour in found}
                return nearest.decide(view)

        return Decider()


@pytest.mark.parametrize("knowledge", Knowledge)
def test_no_hidden_information_leaks(knowledge):
    """Views and briefings contain no id, place or workload of an unknown task, and no hour of a future failure."""
    drawn = random_mission(MissionParameters(family="failures", agents=5, tasks=8, sensing=0.25), 1)
    mission = Mission(
        drawn.instance,
        appears=drawn.appears,
        events=[*drawn.events, Event(4.25, "agent-fails", agent="a1")][-1:],
        sensing=0.25,
        radio=drawn.radio,
        horizon=6.0,
    )
    policy = Searching(mission)
    simulate(mission, policy, knowledge=knowledge)
    assert policy.unknown > 0
    area = {float(end) for ends in mission.area for end in ends}  # which all know
    assert policy.leaks - area == set()


def test_search_covers_private_attributes():
    """Ids and hours are found in containers and attributes of any depth."""
    mission = random_mission(MissionParameters(family="failures", agents=3, tasks=2), 1)

    class Holder:
        def __init__(self):
            self._kept = {"by name": (mission,)}

    found = everything_in(set(), Holder())
    assert {"t1", "t2", mission.events[0].hour} <= found
