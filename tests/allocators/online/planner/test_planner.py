"""A planner gets events and reports of agents, and returns orders with the causes of their changes."""

import gc
import math
from collections import defaultdict

import numpy as np
import pytest
from drawn_missions import random_mission_of_any_kind

from alloc.allocators import AgentDecider, Briefing, MissionPlanner, Policy, PolicyInfo, Report, simulate
from alloc.problems import Event, InputError, Mission
from alloc.problems.missions.simulation.state import STAY, Order


def tasks(planner):
    """Return the task of each agent in the plan."""
    return {agent: order.task for agent, order in planner.plan().items()}


def test_orders_respond_to_events(pair):
    """Plans follow a failure, a new task and a completion, and name them as causes."""
    with MissionPlanner(pair, "nearest", None) as planner:
        assert tasks(planner) == {"ann": "t1", "ben": "t2"}
        planner.submit(Event(1.5, "agent-fails", agent="ben"))
        assert tasks(planner) == {"ann": "t1"}
        (change,) = planner.why_changed()
        assert (change.agent, change.before, change.after) == ("ben", Order("t2"), None)
        assert change.cause == "agent ben failed at 1.5"
        planner.submit({"event": "task-appears", "task": {"id": "t3", "workload": 1, "position": [0, 2]}})
        planner.submit({"event": "agent-joins", "agent": {"id": "cat", "ability": 1, "position": [0, 2], "speed": 1}})
        assert tasks(planner) == {"ann": "t1", "cat": "t3"}
        assert [change.cause for change in planner.why_changed()] == [
            "agent cat joined at 1.5; task t3 appeared at 1.5"
        ]
        assert planner.plan(3.25)["ann"] == Order("t2")  # t1 is done at 3: 1 hour of flight, 2 of work
        causes = {change.agent: change.cause for change in planner.why_changed()}
        assert "task t1 was done at 3" in causes["ann"]
        assert planner.hour == 3.25


def test_reports_correct_the_state(pair):
    """A reported place, battery or work left counts from then on."""
    with MissionPlanner(pair, "nearest", None) as planner:
        planner.plan()
        planner.submit(Report(0.5, "ann", position=(0, 0.2)))  # it is slow
        planner.submit({"hour": 1.0, "event": "task-changes", "task": "t2", "workload": 0.0})
        planner.submit(Report(1.0, "ben", position=(4, 0), battery=1.0))
        assert tasks(planner) == {"ann": "t1", "ben": None}  # t1 is too far for what is left
        assert planner.plan(3.29)["ann"] == Order("t1")  # without the report it was done at 3
        assert planner.plan(3.31)["ann"] == STAY
        planner.submit(Report(4.0, "ben", battery=20))
        planner.submit({"event": "task-changes", "task": "t1", "workload": 1.0})  # it was not done, after all
        assert tasks(planner) == {"ann": "t1", "ben": "t1"}
        planner.submit(Report(4.5, "ben", task="t1"))  # there already: 2 + 3 do the rest of 0 at once
        assert planner.plan(4.51)["ann"] == STAY


def test_agent_that_cannot_continue_has_no_order(pair):
    """A reported battery that does not suffice for the flight ends it, and the cause says so."""
    with MissionPlanner(pair, "nearest", None) as planner:
        planner.plan()
        planner.submit(Report(0.5, "ann", battery=0.25))
        assert tasks(planner)["ann"] is None
        (change,) = planner.why_changed()
        assert "cannot go on: the flight takes 0.5 of energy, battery 0.25" in change.cause


def test_pinned_agents_stay_with_their_task(pair):
    """No policy sends them elsewhere; a pin ends with its task, or when it is removed."""
    with MissionPlanner(pair, "nearest", None) as planner:
        planner.pin("ann", "t2")
        planner.pin("ben", None)
        assert tasks(planner) == {"ann": "t2", "ben": None}
        planner.unpin("ben")
        assert tasks(planner) == {"ann": "t2", "ben": "t2"}
        assert planner.why_changed()[0].cause == "agent ben was unpinned at 0"
        planner.submit(Event(1.0, "task-cancelled", task="t2"))
        assert tasks(planner) == {"ann": "t1", "ben": "t1"}
        for agent, task, told in (("ann", "t2", "the task is cancelled"), ("dan", "t1", "no agent 'dan'")):
            with pytest.raises(InputError, match=told):
                planner.pin(agent, task)


def test_future_events_are_not_known(pair):
    """Later agents, tasks and events of the mission have no effect before they are submitted."""
    mission = Mission(pair, appears=[0, 2], joins=[0, 1], events=[Event(0.5, "agent-fails", agent="ann")])
    with MissionPlanner(mission, "nearest", None) as planner:
        assert {agent: order.task for agent, order in planner.plan(2.5).items()} == {"ann": "t1"}
        planner.submit({"event": "agent-joins", "agent": "ben"})
        planner.submit({"event": "task-appears", "task": "t2"})
        assert tasks(planner) == {"ann": "t1", "ben": "t2"}


def test_deadlines_pass_by_themselves(pair):
    """No agent is sent to a missed task."""
    with MissionPlanner(Mission(pair, deadline=[2, np.nan]), "nearest", None) as planner:
        assert tasks(planner) == {"ann": "t1", "ben": "t2"}
        assert planner.plan(2.0)["ann"] == Order("t2")
        assert "task t1 was missed at 2" in planner.why_changed()[0].cause


def test_work_that_was_not_done_by_the_deadline_is_missed(pair):
    """If work of a done task is reported after its deadline, the task is missed, and no agent is sent there."""
    with MissionPlanner(Mission(pair, deadline=[4, np.nan]), "nearest", None) as planner:
        planner.plan()
        assert planner.plan(3.5)["ann"] != Order("t1")  # it is done at 3
        planner.submit({"hour": 5.0, "event": "task-changes", "task": "t1", "workload": 1.0})
        assert planner.plan()["ann"] != Order("t1")
        assert planner._estimate.state.task("t1").missed == 1.0


@pytest.mark.parametrize("policy", ["greedy", "hedonic"])
def test_state_agrees_with_the_simulation(policy):
    """Given the events of a mission as they happen, it gives the same orders as in a simulation, at the same hours."""
    compared = 0
    for seed in range(40):
        mission = random_mission_of_any_kind(np.random.default_rng(seed))
        log = simulate(mission, policy, knowledge="full").log
        hours = defaultdict(list)
        for record in log.records:
            hours[record["hour"]].append(record)
        start = Mission(
            mission.instance,
            joins=np.maximum(mission.joins, 1e-9),
            appears=np.maximum(mission.appears, 1e-9),
            deadline=mission.deadline,
            growth=mission.growth,
            pace=mission.pace,
            seed=mission.seed,
        )
        with MissionPlanner(start, policy, None) as planner:
            for hour, records in hours.items():
                for record in records:
                    if record["record"] == "event":
                        row = {name: value for name, value in record.items() if name != "record"}
                        planner.submit(row)
                plan = planner.plan(hour)
                for record in records:
                    if record["record"] == "order" and record["task"] is not None:
                        assert plan[record["agent"]].task == record["task"], (seed, hour)
                        compared += 1
    assert compared > 50


class Stubborn(Policy):
    """Returns given orders, or fails."""

    info = PolicyInfo(name="stubborn", summary="for tests")

    def __init__(self, answer):
        super().__init__()
        self.answer = answer

    def begin(self, briefing: Briefing) -> AgentDecider:
        decider = type("Decider", (AgentDecider,), {"decide": lambda _, view: self.answer(view)})
        return decider()


def test_failing_policy_leaves_the_last_plan(pair):
    """The plan says why it is not new; orders that cannot be followed are not given."""
    answers = {"now": lambda view: Order("t1")}
    with MissionPlanner(pair, Stubborn(lambda view: answers["now"](view)), None) as planner:
        assert tasks(planner) == {"ann": "t1", "ben": "t1"}
        answers["now"] = lambda view: 1 / 0
        planner.submit(Event(0.5, "agent-fails", agent="ann"))
        plan = planner.plan()
        assert (dict(plan), plan.is_new) == ({"ben": Order("t1")}, False)
        assert plan.problem == "ZeroDivisionError: division by zero"
        for hour, answer in ((0.6, Order("t9")), (0.7, Order(position=(math.nan, 0, 0))), (0.8, "t1")):
            answers["now"] = lambda view, answer=answer: answer
            planner.submit(Event(hour, "task-changes", task="t1", workload=5))
            assert dict(planner.plan()) == {"ben": Order("t1")}


def test_obsolete_entries_are_dropped(pair):
    """However often agents are diverted, the agenda stays small, and no garbage is collected meanwhile."""
    seen = []

    def turn_round(view):
        seen.append(gc.isenabled())
        return Order("t1" if round(view.hour * 1000) % 2 else "t2")

    with MissionPlanner(pair, Stubborn(turn_round), 10_000) as planner:
        for step in range(40):
            planner.submit(Report(step / 1000, "ann", battery=19))
            assert planner.plan().is_new
            assert len(planner._estimate.agenda) <= 4 * 4
    assert not any(seen)
    assert gc.isenabled()


def test_parameters_require_a_policy_name(pair):
    """Parameters for a policy given as an object, and unknown parameters, are errors."""
    with pytest.raises(InputError, match="policy: is an object with its own parameters"):
        MissionPlanner(pair, Stubborn(lambda view: None), stay=1)
    with pytest.raises(InputError, match="takes no option 'sty'"):
        MissionPlanner(pair, "greedy", sty=1)
