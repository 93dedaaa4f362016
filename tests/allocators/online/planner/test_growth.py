"""Time and memory of a planner depend on present agents and tasks only; time is counted in steps of Python."""

import gc
import sys
import threading

import pytest

from alloc.allocators import MissionPlanner
from alloc.allocators.online.groups import announced
from alloc.allocators.online.planner import estimate, policy_runner, register
from alloc.allocators.online.routes import describe, tables
from alloc.problems import InputError, Instance
from alloc.problems.changes.remove import replaced
from alloc.problems.distances.given import DistanceTable

FEW = 5
"""How many are kept here of those that are over, so that a short stream shows what a long one would."""


class Steps:
    """Counts the steps of Python in this thread and in threads started within the context."""

    def __init__(self):
        self.count, self.is_counting = 0, False

    def __enter__(self):
        self._before = sys.gettrace()
        threading.settrace(self._trace)
        sys.settrace(self._trace)
        return self

    def __exit__(self, *_):
        sys.settrace(self._before)
        threading.settrace(self._before)

    def _trace(self, frame, event, _):
        if not self.is_counting:
            return None
        frame.f_trace_opcodes, frame.f_trace_lines = True, False
        self.count += event == "opcode"
        return self._trace


@pytest.fixture
def few(monkeypatch):
    """Limit the number of closed entries that are kept."""
    kept = (
        (register, "KEPT_CLOSED"),
        (policy_runner, "KEPT_CLOSED"),
        (estimate, "KEPT_NEWS"),
        (announced, "SPARE_ROUTES"),
    )
    for module, name in kept:
        monkeypatch.setattr(module, name, FEW)


def crew():
    """Return the agents a0 to a2 and tasks t0 to t2."""
    places = [[0, 0], [1, 1], [2, 2]]
    return Instance(
        agent_ids=["a0", "a1", "a2"],
        task_ids=["t0", "t1", "t2"],
        ability=[1, 1, 1],
        workload=[9, 9, 9],
        agent_position=places,
        task_position=places,
        speed=[1, 1, 1],
    )


def exchange(planner, number):
    """Add a task and an agent, and close those that came three exchanges before; plan after each event."""
    place, row = [number % 5, number % 3], {"id": f"a{number}", "ability": 1, "speed": 1}
    task = {"id": f"t{number}", "workload": 9, "position": place, "deadline": 9e5, "growth": 0.1}
    for event in (
        {"event": "task-appears", "task": task},
        {"event": "agent-joins", "agent": {**row, "position": place}},
        {"event": "task-changes", "task": f"t{number - 3}", "workload": 0},
        {"event": "agent-fails", "agent": f"a{number - 3}"},
    ):
        planner.submit({"hour": number / 10, **event})
        assert planner.plan().problem is None


def costs(planner, steps, numbers, file):
    """Return the steps for some exchanges, and afterwards the objects in memory and the length of the file."""
    steps.count, steps.is_counting = 0, True
    for number in numbers:
        exchange(planner, number)
    steps.is_counting = False
    planner.save(file)
    gc.collect()
    return steps.count, len(gc.get_objects()), file.stat().st_size


@pytest.mark.parametrize("policy", ["greedy", "hedonic", "auction"])
def test_costs_do_not_grow_with_closed_tasks_and_agents(few, policy, tmp_path):
    """After 100 further agents and tasks, exchanges take as many steps, and memory and file are as large as before."""
    with Steps() as steps, MissionPlanner(crew(), policy, None) as planner:
        for number in range(3, 20):
            exchange(planner, number)  # until as many are over as are kept
        early = costs(planner, steps, range(20, 30), tmp_path / "planner.json")
        for number in range(30, 120):
            exchange(planner, number)
        late = costs(planner, steps, range(120, 130), tmp_path / "planner.json")
    assert late[0] < 1.1 * early[0]
    assert late[1] < early[1] + 400
    assert late[2] < 1.1 * early[2]
    known = planner._estimate.state
    assert max(len(known.all_agents), len(known.all_tasks)) <= 3 + 2 * FEW + 1
    assert len(planner._runner._agents) <= 3 + 2 * (3 + FEW)


def test_oldest_closed_tasks_are_forgotten(few, tmp_path):
    """Only the last closed tasks can be reopened, also in a restored planner; older ids can be used anew."""
    with MissionPlanner(crew(), "nearest", None) as planner:
        for number in range(3, 40):
            exchange(planner, number)
        planner.save(tmp_path / "planner.json")
        with MissionPlanner.restore(tmp_path / "planner.json") as again:
            for one in (planner, again):
                with pytest.raises(InputError, match="there is no task 't2'"):
                    one.submit({"event": "task-changes", "task": "t2", "workload": 1})
                with pytest.raises(InputError, match="there is task 't36' already"):
                    one.submit({"event": "task-appears", "task": {"id": "t36", "workload": 1}})
                one.submit({"event": "task-changes", "task": "t36", "workload": 1})
                one.submit({"event": "task-appears", "task": {"id": "t2", "workload": 1, "position": [0, 0]}})
            assert [task.facts.id for task in again._estimate.state.tasks] == ["t36", "t37", "t38", "t39", "t2"]
            assert again.plan() == planner.plan()
            for number in range(40, 45):
                exchange(planner, number)
                exchange(again, number)
                assert again.plan() == planner.plan()


def test_target_of_a_flight_is_not_forgotten(few):
    """Whatever is closed meanwhile, the agent on its way there gets its next order as usual."""
    with MissionPlanner(crew(), "nearest", None) as planner:
        planner.submit({"event": "task-appears", "task": {"id": "far", "workload": 1, "position": [500, 0]}})
        planner.pin("a0", "far")
        planner.plan()
        planner.submit({"hour": 0.1, "event": "task-cancelled", "task": "far"})
        for number in range(3, 40):
            task = {"id": f"t{number}", "workload": 9}
            planner.submit({"hour": 0.2, "event": "task-appears", "task": task})
            planner.submit({"hour": 0.2, "event": "task-cancelled", "task": f"t{number}"})
        assert planner.plan()["a0"].task != "far"
        assert planner.plan().problem is None


def test_number_of_news_between_plans_is_limited(few):
    """If no plan is requested for long, only the last news are kept."""
    with MissionPlanner(crew(), "nearest", None) as planner:
        planner.plan()
        for number in range(40):
            planner.submit({"hour": 0.1 + number / 100, "event": "task-changes", "task": "t0", "workload": 9 + number})
        assert len(planner._estimate.news) <= 2 * FEW
        planner.plan()
        assert planner._estimate.news == []


def test_routes_forgets_closed_tasks(few, monkeypatch):
    """The policy `routes` drops its data on growing tasks and on distances by a table once tasks are closed."""
    monkeypatch.setattr(describe, "SPARE_TASKS", FEW)
    monkeypatch.setattr(tables, "SPARE_DISTANCES", FEW)
    rows = [(f"t{i}", f"t{j}", 1.0) for i in range(3) for j in range(3) if i != j]
    instance = replaced(crew(), distances=DistanceTable.of(rows, ["a0", "a1", "a2"], ["t0", "t1", "t2"]))
    describer = describe.Describer(1e6, 1.0, 0.0)
    with MissionPlanner(instance, "nearest", None) as planner:
        for number in range(3, 60):
            exchange(planner, number)
            view = planner._estimate.view({})
            assert describer.describe(view, describe.Foresight()) is not None
    assert len(describer._begun) + len(describer._seen) <= 2 * (4 + FEW)
    assert len(describer._tables._ways) <= 4 * (4 * 4 + FEW) + 4 * 4


def test_routes_of_agents_that_are_gone_are_forgotten(few):
    """In `local-routes`, an agent that lasts keeps few routes of those that have failed."""
    with MissionPlanner(crew(), "local-routes", None) as planner:
        planner.submit(
            {"event": "agent-joins", "agent": {"id": "lasting", "ability": 1, "speed": 1, "position": [0, 0]}}
        )
        for number in range(3, 40):
            exchange(planner, number)
        assert len(planner._runner._agents["lasting"]._announced.routes) <= 2 * (4 + FEW)
