"""Invalid input is one clear error and changes nothing; a killed planner can be restored with the same plan."""

import asyncio
import json
import math
import threading
import time

import pytest
from schema_checks import faults

from alloc.allocators import AgentDecider, Briefing, MissionPlanner, Policy, PolicyInfo, Report
from alloc.problems import Event, InputError, Instance
from alloc.problems.missions.simulation.state import Order

FAIL = {"hour": 2.0, "event": "agent-fails", "agent": "ann"}

WRONG = (
    (FAIL, "event: was submitted before, at the same hour"),
    ({**FAIL, "hour": 1.0}, "hour: is 1, but it is already hour 2; events come in order"),
    ({**FAIL, "hour": 3.0}, "event: agent-fails needs agent 'ann' to be away or in the mission, but it is failed"),
    ({**FAIL, "agent": "bem"}, "agent: there is no agent 'bem' (did you mean 'ben'?)"),
    ({**FAIL, "hour": math.nan}, "hour: must be a finite number"),
    ({**FAIL, "event": "agent-fail"}, "event: there is no event 'agent-fail' (did you mean 'agent-fails'?)"),
    ({"hour": 3.0, "agent": "ben"}, "event: is missing; it must be one of"),
    ({**FAIL, "amount": 3}, "unknown field 'amount'"),
    ({"event": "agent-returns", "agent": "ben"}, "needs agent 'ben' to be away, but it is in the mission"),
    ({"event": "agent-recharges", "agent": "ben"}, "amount: is missing"),
    ({"event": "agent-recharges", "agent": "ben", "amount": math.nan}, "amount: must be a finite number"),
    ({"event": "task-changes", "task": "t9", "workload": 1}, "task: there is no task 't9'"),
    ({"event": "task-changes", "task": "t1", "workload": -1}, "workload: must be a finite number >= 0"),
    ({"event": "task-appears", "task": "t1"}, "needs task 't1' to be to come, but it is there"),
    ({"event": "task-appears", "task": {"id": "t1", "workload": 1}}, "task.id: there is task 't1' already"),
    ({"event": "task-appears", "task": {"id": "t3", "workload": math.nan}}, "task.workload: must be a finite number"),
    ({"event": "task-appears", "task": {"id": "t3", "work": 1}}, "unknown field 'work'"),
    ({"event": "task-appears", "task": {"workload": 1}}, "task.id: must be a non-empty string"),
    ({"event": "agent-joins", "agent": {"id": "cat", "ability": 1, "tasks": ["t7"]}}, "t7"),
    ({"event": "agent-reports", "agent": "ben"}, "reports nothing; give position or task, battery, or both"),
    ({"event": "agent-reports", "battery": 1}, "agent: is missing"),
    ({"event": "agent-reports", "agent": "ann", "battery": 1}, "agent 'ann' is failed, and cannot report"),
    ({"event": "agent-reports", "agent": "ben", "position": [0, math.nan]}, "position: must be finite numbers"),
    ({"event": "agent-reports", "agent": "ben", "position": "here"}, "position: must be a list"),
    ({"event": "agent-reports", "agent": "ben", "task": "t9"}, "task: there is no task 't9'"),
    (
        {"event": "agent-reports", "agent": "ben", "position": [0, 0], "task": "t1"},
        "task: gives the place of the agent",
    ),
    ("agent-fails", "event: must be"),
)


@pytest.fixture
def planner(pair):
    """Return a planner in which ann has failed at hour 2."""
    with MissionPlanner(pair, "nearest", None) as planner:
        planner.plan()
        planner.submit(FAIL)
        yield planner


def test_invalid_input_is_an_error_and_changes_nothing(planner, tmp_path):
    """Out of order, twice, unknown, not a number, impossible: one line that names the field, and the same state."""
    plan = planner.plan()
    planner.save(tmp_path / "before.json")
    for event, told in WRONG:
        with pytest.raises(InputError) as caught:
            planner.submit(event)
        assert told in str(caught.value)
        assert "\n" not in str(caught.value)
    for hour in (1.0, math.nan, -1):
        with pytest.raises(InputError, match="hour"):
            planner.plan(hour)
    planner.save(tmp_path / "after.json")
    assert (tmp_path / "before.json").read_bytes() == (tmp_path / "after.json").read_bytes()
    assert planner.plan() is plan


def test_killed_planner_is_restored_with_the_same_plan(pair, tmp_path):
    """Restored from its file, it has the same plan and causes, and makes the same plans from then on."""
    file = tmp_path / "planner.json"
    later = [
        {"hour": 1.0, "event": "task-changes", "task": "t3", "workload": 3.0},
        {"hour": 1.4, "event": "agent-fails", "agent": "ben"},
        {"hour": 2.5, "event": "agent-reports", "agent": "cat", "position": [1.5, 1.5], "battery": 3},
    ]
    with MissionPlanner(pair, "replan", None, seed=2**62 + 1, iterations=3, method="greedy") as planner:
        planner.plan()
        planner.submit({"event": "agent-joins", "agent": {"id": "cat", "ability": 1, "start_task": "t2", "speed": 1}})
        planner.submit(
            {
                "hour": 0.5,
                "event": "task-appears",
                "task": {"id": "t3", "workload": 2, "position": [2, 2], "deadline": 9},
            }
        )
        planner.pin("cat", "t3")
        planner.plan()
        planner.submit({"hour": 0.7, "event": "agent-reports", "agent": "ann", "position": [0, 0.3]})
        planner.save(file)
        assert faults(json.loads(file.read_text())) == []
        with MissionPlanner.restore(file) as again:
            again.save(tmp_path / "again.json")
            assert (tmp_path / "again.json").read_bytes() == file.read_bytes()
            assert again.plan() == planner.plan()
            assert again.why_changed() == planner.why_changed()
            with pytest.raises(InputError, match="submitted before"):
                again.submit({"hour": 0.7, "event": "agent-reports", "agent": "ann", "position": [0, 0.3]})
            for event in later:
                planner.submit(event)
                again.submit(event)
                assert again.plan() == planner.plan()
            assert again.plan(20) == planner.plan(20)


def test_damaged_files_are_errors(pair, tmp_path):
    """A file that is not a planner, or was truncated or edited, is a one-line error with its name."""
    file = tmp_path / "planner.json"
    with MissionPlanner(pair, "nearest") as planner:
        planner.save(file)
    document = json.loads(file.read_text())
    for text in (
        file.read_text()[:200],
        "{}",
        json.dumps({**document, "agents": []}),
        json.dumps({**document, "hour": "now"}),
        json.dumps({**document, "plan": 3}),
        json.dumps({**document, "policy": "gredy"}),
    ):
        file.write_text(text)
        with pytest.raises(InputError, match=r"planner\.json: ") as caught:
            MissionPlanner.restore(file)
        assert "\n" not in str(caught.value)


class Slow(Policy):
    """Decides late, and counts its decisions."""

    info = PolicyInfo(name="slow", summary="for tests")

    def __init__(self, seconds):
        super().__init__()
        self.seconds = seconds

    def begin(self, briefing: Briefing) -> AgentDecider:
        decide = lambda _, view: time.sleep(self.seconds) or Order("t2")  # noqa: E731
        return type("Decider", (AgentDecider,), {"decide": decide})()


def test_deadline_is_respected_with_a_late_policy(pair):
    """With a late policy, the last orders stay; orders given in time count now, and the others in the next plan."""
    policy = Slow(0.3)
    with MissionPlanner(pair, policy, deadline_ms=400) as planner:
        began = time.perf_counter()
        plan = planner.plan()
        assert time.perf_counter() - began < 0.4 + 0.3  # how long a busy machine may take to wake it
        assert not plan.is_new
        assert set(plan) == {"ann", "ben"}
        policy.seconds = 0
        for _ in range(50):
            if planner.plan().is_new:
                break
            time.sleep(0.1)
        assert dict(planner.plan()) == {"ann": Order("t2"), "ben": Order("t2")}


def test_all_agents_get_a_turn_with_a_slow_policy():
    """If time never suffices for all agents, each plan begins with those that had no turn in the last one."""
    many = Instance(ability=[1] * 10, workload=[99, 99], agent_position=[[0, 0]] * 10, task_position=[[9, 9]] * 2)
    hours = iter(range(1, 99))
    with MissionPlanner(many, Slow(0.04), deadline_ms=200) as planner:
        for hour in hours:
            plan = planner.plan()
            if all(order.task == "t2" for order in plan.values()):
                break
            planner.submit({"hour": hour / 1000, "event": "task-changes", "task": "t1", "workload": 50 + hour})
            assert hour < 40
        assert not plan.is_new


def test_ten_threads_can_share_a_planner(pair, tmp_path):
    """With reports, plans, pins and saves from ten threads, nothing is lost, and every plan can be followed."""
    problems = []

    def work(number, planner, path):
        for step in range(15):
            try:
                planner.submit({"event": "task-appears", "task": {"id": f"{number}-{step}", "workload": 0.1}})
                planner.submit(Report(planner.hour, ("ann", "ben")[number % 2], battery=15 + number + step / 100))
                plan = planner.plan()
                assert set(plan) == {"ann", "ben"}
                if step == 7:
                    planner.pin("ann", f"{number}-7")
                    planner.save(path / f"{number}.json")
                    planner.why_changed()
            except Exception as error:
                problems.append(error)

    with MissionPlanner(pair, "greedy", deadline_ms=5000) as planner:
        threads = [threading.Thread(target=work, args=(number, planner, tmp_path)) for number in range(10)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert problems == []
        planner.save(tmp_path / "all.json")
        names = {task["id"] for task in json.loads((tmp_path / "all.json").read_text())["tasks"]}
        assert names == {"t1", "t2", *(f"{number}-{step}" for number in range(10) for step in range(15))}
        assert planner.plan() is planner.plan()


def test_asyncio_is_not_blocked_while_it_plans(pair):
    """While a plan is awaited in a thread, the event loop keeps running."""

    async def turns():
        count = 0
        with MissionPlanner(pair, Slow(0.1), deadline_ms=None) as planner:
            waiting = asyncio.create_task(asyncio.to_thread(planner.plan))
            while not waiting.done():
                await asyncio.sleep(0.005)
                count += 1
            return count, await waiting

    count, plan = asyncio.run(turns())
    assert count >= 5
    assert dict(plan) == {"ann": Order("t2"), "ben": Order("t2")}


def test_closed_planner_raises(pair):
    """A closed planner raises an error instead of waiting forever."""
    planner = MissionPlanner(pair, "nearest", None)
    planner.close()
    planner.submit(Event(0.5, "agent-fails", agent="ann"))
    with pytest.raises(InputError, match="planner: is closed"):
        planner.plan()
