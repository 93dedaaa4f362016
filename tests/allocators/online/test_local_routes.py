"""Routes with local knowledge: agreement through messages, and exploration."""

import numpy as np
import pytest

from alloc.allocators import simulate
from alloc.allocators.online.contract import Briefing
from alloc.allocators.online.groups import announced as announced_routes
from alloc.allocators.online.groups.announced import Announced, Route
from alloc.allocators.online.groups.contact import in_contact
from alloc.allocators.online.policies.local_routes import LocalRoutes
from alloc.allocators.online.policies.spreading import Lookout
from alloc.problems import Instance, Mission, Radio
from alloc.problems.missions.simulation.places import Place
from alloc.problems.missions.simulation.reports import Message
from alloc.problems.missions.simulation.simulation import Simulation
from alloc.problems.missions.simulation.state import STAY

EARLY = Route(1.0, "a1", (("t1", 3.0), ("t2", 5.0)))
LATE = Route(2.0, "a2", (("t2", 4.0),))


def announced(**routes):
    found = Announced()
    for agent, route in routes.items():
        found.plan(agent, route)
    return found


def drawn(sensing=0.3, **more):
    instance = Instance(
        ability=[1, 1, 1],
        workload=[1, 1, 1, 1],
        agent_position=[[0, 0], [0.1, 0], [1, 1]],
        task_position=[[0.2, 0], [0, 0.2], [0.9, 1], [1, 0.1]],
        speed=[0.5] * 3,
        **more,
    )
    radio = Radio(radius=0.3, period=0.1)
    return Mission(instance, knowledge="local", sensing=sensing, radio=radio, horizon=40.0, seed=1)


def test_notes_contain_all_routes():
    """An agent that receives notes knows all routes of their sender, whatever it knew before."""
    one, other = announced(a1=EARLY, a2=LATE), announced(a1=Route(0.5, "a1", (("t9", 1.0),)))
    other.hear(one.notes())
    assert other.routes == one.routes


@pytest.mark.parametrize("order", [(EARLY, LATE), (LATE, EARLY)])
def test_newer_route_counts(order):
    """The order in which two routes of an agent are received does not matter."""
    known = announced()
    for route in order:
        known.plan("a3", route)
    assert known.routes == {"a3": LATE}


def test_first_planner_counts_at_equal_hours():
    """All agents agree on one of two plans made at the same hour."""
    one, other = Route(1.0, "a1", ()), Route(1.0, "a2", (("t1", 2.0),))
    for order in ((one, other), (other, one)):
        known = announced()
        for route in order:
            known.plan("a3", route)
        assert known.routes["a3"] == one


def test_planner_may_replace_its_own_route_in_the_same_hour():
    """Of two routes by one planner in the same hour, the last counts."""
    known = announced(a1=EARLY)
    known.plan("a1", Route(1.0, "a1", (("t3", 2.0),)))
    assert known.routes["a1"].tasks == ["t3"]


def test_tasks_in_current_routes_of_others_are_left_to_them():
    """A task belongs to the newest route that contains it; a route that ended long ago no longer counts."""
    known = announced(a1=EARLY, a2=LATE)
    assert known.taken({"a3"}, 3.0, 1.0) == {"t1": 3.0, "t2": 4.0}
    assert known.taken({"a2"}, 3.0, 1.0) == {"t1": 3.0}
    assert known.taken({"a3"}, 8.0, 1.0) == {"t1": 3.0, "t2": 5.0}
    assert known.taken({"a3"}, 10.0, 1.0) == {}


def test_only_routes_that_reserve_open_tasks_for_unknown_agents_are_kept(monkeypatch):
    """Nothing is forgotten within the limit; beyond it, what is dropped reserves no open task."""
    routes = {"a1": EARLY, "a2": LATE, "a3": Route(0.0, "a3", (("t2", 9.0),)), "a4": Route(0.0, "a4", (("t4", 9.0),))}
    known = announced(**routes)
    known.forget({"a4"}, {"t1", "t2"}, 3.0, 1.0)
    assert known.routes == routes
    monkeypatch.setattr(announced_routes, "SPARE_ROUTES", 0)
    taken = known.taken({"a4"}, 3.0, 1.0)
    known.forget({"a4"}, {"t1", "t2"}, 3.0, 1.0)
    assert known.routes == {"a1": EARLY, "a2": LATE, "a4": routes["a4"]}
    assert known.taken({"a4"}, 3.0, 1.0) == taken


def test_task_planned_twice_stays_with_the_earliest():
    """Agents that meet drop tasks that another plan does earlier; a coalition within one plan stays."""
    known = announced(a1=EARLY, a2=LATE)
    assert known.joined(["a1", "a2"]) == {"a1": ["t1"], "a2": ["t2"]}
    together = announced(a1=EARLY, a2=EARLY)
    assert together.joined(["a1", "a2"]) == {"a1": ["t1", "t2"], "a2": ["t1", "t2"]}


def looked(mission, others):
    """Return where the first agent is sent to explore from its start."""
    simulation = Simulation(mission)
    simulation.advance()
    view = simulation.view("a1")
    lookout = Lookout(Briefing.of(mission, mission.knowledge, 0, None, "a1"), 5.0)
    lookout.note(view)
    return lookout.order(view, others)


def test_agents_explore_their_parts_of_the_area():
    """An agent explores cells that it has not fully seen and that no other agent is closer to."""
    for other in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)):
        goal = looked(drawn(), [Place(other)]).position
        assert np.linalg.norm(goal) > 0.25
        assert np.linalg.norm(goal) <= np.linalg.norm(np.subtract(goal, other)) + 1e-9


def test_cell_counts_as_seen_only_as_a_whole():
    """A corner of the area, at 1.41, is explored although the centre of its cell, at 1.38, was seen from (0.1, 0)."""
    goal = looked(drawn(sensing=1.33), []).position
    assert np.linalg.norm(goal) > 1.28


def test_agents_that_see_everything_do_not_explore():
    """There is nothing to look for."""
    assert looked(drawn(sensing=np.inf), []) == STAY


@pytest.mark.parametrize(("radius", "reached"), [(0.05, ["a1"]), (0.3, ["a1", "a2"]), (1.4, ["a1", "a2", "a3"])])
def test_agents_seen_beyond_radio_range_are_not_in_contact(radius, reached):
    """All agents see each other; a3 hears the first agent only through the second one, at 1.35 from it."""
    simulation = Simulation(drawn(sensing=5.0))
    simulation.advance()
    view = simulation.view("a1")
    assert len(view.agents) == 3
    assert in_contact(view, radius, view.hour) == reached


def test_old_reports_do_not_count_as_contact():
    """An agent that was not heard of for too long is no longer in contact."""
    simulation = Simulation(drawn(sensing=5.0))
    simulation.advance()
    view = simulation.view("a1")
    assert in_contact(view, 5.0, view.hour + 1.0) == ["a1"]


@pytest.mark.slow
@pytest.mark.timeout(300)
def test_agent_abandons_a_route_beyond_its_battery():
    """A route planned by others may need more energy than the agent has by now."""
    mission = drawn(energy_per_distance=1, battery=[1, 1e-3, 1])
    simulation = Simulation(mission)
    simulation.advance()
    view, route = simulation.view("a2"), Route(-1.0, "a1", (("t1", 1.0),))
    view.heard = (Message("a1", 0.0, notes=announced(a2=route).notes()),)
    decider = LocalRoutes(iterations=0, first_iterations=0).begin(
        Briefing.of(mission, mission.knowledge, 0, None, "a2")
    )
    decider.decide(view)
    told = Announced()
    told.hear(decider.message(view).notes)
    assert told.routes["a2"].tasks == []


@pytest.mark.slow
@pytest.mark.timeout(300)
@pytest.mark.parametrize("metric", ["euclidean", "manhattan"])
def test_agents_out_of_contact_do_all_tasks(metric):
    """Two agents in contact and one far away find and do tasks that none of them sees at first."""
    result = simulate(drawn(metric=metric), "local-routes", iterations=20, first_iterations=20).result
    assert result.status == "done"
