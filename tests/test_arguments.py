"""Public functions report invalid arguments by the name of the parameter."""

import json
import pickle
from copy import deepcopy
from functools import partial

import numpy as np
import pytest

from alloc.allocators import Budget, MakespanTolerance, load, solve
from alloc.allocators.experiments.compare import compare
from alloc.allocators.experiments.whatif import whatif
from alloc.allocators.pareto import pareto
from alloc.problems import (
    Allocation,
    AllocError,
    Family,
    InputError,
    Instance,
    MissingPackageError,
    RefusedError,
    TrainingError,
    energy_lower_bound,
    evaluate,
    fewest_unserved,
    machine_covering,
    makespan_lower_bound,
    paper,
    random_instance,
    read_instance,
    serve_all,
    write_model,
)

SMALL = Instance(ability=[1, 2, 3], workload=[2, 3, 1], start_task=[0, 1, 2])
NAN, INF = float("nan"), float("inf")

make = partial(Instance, ability=[1, 2, 3], workload=[2, 3, 1])
run = partial(solve, SMALL, "greedy")
NUMBERS = ("x", ["1", "2", "3"], [True, False, True], 5, [[1, 2, 3]], [1j, 1, 1], {"a": 1})
SEEDS = (-1, 1.5, "1", None, True)

DOORS = [
    *((make, name, NUMBERS) for name in ("ability", "workload", "battery", "communication_range", "speed", "priority")),
    *((make, name, ("x", [[0, 0]], 5, [["0", "0"]] * 3)) for name in ("agent_position", "task_position")),
    (make, "start_task", ([0.5, 0, 0], [0, 1], ["0", "1", "2"], 5, [True, False, True])),
    *((make, name, ("abc", 5, ["a"], {"a", "b", "c"})) for name in ("agent_ids", "task_ids")),
    (make, "allowed_tasks", (5, "abc", [None], np.eye(3, dtype=int), np.eye(3, dtype=bool))),
    (make, "allowed_tasks", (np.eye(3, dtype=int).tolist(),)),
    (make, "name", (None, 5)),
    *((make, name, ("0.5", None, NAN, INF, -1, True, [0.5])) for name in ("tau", "energy_per_distance")),
    (SMALL.without_agents, "gone", ("a1", 5, ["a4"], [1], [["a1"]])),
    (Allocation, "task_of_agent", ([0.9, 1.2], np.array([2**64 - 1], np.uint64), [NAN], [None], "ab")),
    (Allocation, "task_of_agent", ([[0]], 3, [True])),
    (partial(Allocation.from_ids, SMALL), "assignment", (None, 5, [0, 1], {"a1": 3}, {"a1": ["t1"]}, {"x": "t1"})),
    (partial(evaluate, SMALL), "allocation", (None, [0, 1, 2], {"a1": "t1"}, Allocation([0]))),
    (partial(evaluate, allocation=Allocation([0])), "instance", (None, "x.json")),
    *((function, "instance", (None, "x.json", 5)) for function in (makespan_lower_bound, fewest_unserved)),
    (partial(serve_all, SMALL), "allocation", (None, [0, 1, 2])),
    (partial(energy_lower_bound, SMALL), "makespan", ("1", -1, NAN, None)),
    (partial(paper, seed=0), "scenario", (0, 5, "1", None, [1], True)),
    (partial(paper, 1), "seed", SEEDS),
    (partial(random_instance, Family()), "seed", SEEDS),
    (partial(random_instance, seed=0), "family", (None, "random", {})),
    *((Family, name, (0, 1.5, "3", None, True)) for name in ("agents", "tasks", "dimensions", "depots", "clusters")),
    *((Family, name, ("x", None, 5)) for name in ("ability", "workload", "sites", "starts")),
    *((Family, name, (1, "yes", None)) for name in ("integer",)),
    *((partial(machine_covering, 3, 2, 1, 5), name, SEEDS) for name in ("seed",)),
    *((Budget, name, ("1", -1, NAN, INF, True, [1])) for name in ("time_limit_s", "iterations", "target_gap")),
    (Budget, "iterations", (1.5,)),
    *((MakespanTolerance, name, ("1", -1, NAN, INF, True)) for name in ("slack", "limit")),
    (partial(solve, SMALL), "method", (None, 5, "gredy", Allocation)),
    (solve, "instance", (None, "x.json")),
    (run, "objective", ("energy", None, 5, [])),
    *((run, name, ("1", -1, NAN, INF, True)) for name in ("time_limit_s", "target_gap")),
    *((run, name, ("1", -1, NAN, INF, True)) for name in ("makespan_slack", "makespan_limit")),
    (run, "iterations", ("1", -1, 1.5, True)),
    (run, "seed", (*SEEDS, 2**63)),
    (run, "threads", (0, 1.5, "1", True)),
    (run, "start", (5, "x", {"x": "t1"}, {"a1": 3}, [0, 1, 2], Allocation([0]))),
    (run, "on_improvement", (5, "x")),
    (run, "stop", (5, True)),
    (run, "handle_signals", (None, 1, "no")),
    (load, "name", (None, 5)),
    (partial(whatif, SMALL), "like", ("a9", 5, ["a1", 3], {"a1"}, None)),
    (partial(whatif, SMALL), "remove", ("a1", 5, ["a9"], [1])),
    (partial(whatif, SMALL, "a1"), "up_to", (0, 1.5, "1", None)),
    (partial(write_model, SMALL), "path", (None, 5)),
    (partial(write_model, SMALL, "x.lp"), "format", ("xls", 5)),
    (partial(write_model, SMALL, "x.lp"), "model", ("mixed", None)),
    (partial(write_model, SMALL, "x.lp"), "objective", ("energy", None)),
    (partial(write_model, SMALL, "x.lp"), "makespan", ("1", 0, -1, NAN, INF)),
    (partial(pareto, SMALL), "points", (0, 1.5, "1", None)),
    (partial(pareto, SMALL), "starts", (Allocation([0, 1, 2]), [5], 5)),
    (partial(compare, [SMALL]), "methods", ("greedy", 5, [5])),
    (partial(compare, [SMALL], ["greedy"]), "seeds", (3, "3", [1.5], [None])),
    (partial(compare, [SMALL], ["greedy"]), "objective", ("energy", "makespan-moves")),
    (partial(compare, methods=["greedy"]), "instances", (5, "x.json")),
    (read_instance, "path", (None, 5, b"x.json")),
]  # fmt: skip


@pytest.mark.parametrize(
    ("door", "name", "value"), [(door, name, value) for door, name, values in DOORS for value in values]
)
def test_wrong_arguments_are_errors_that_name_them(door, name, value):
    """Each wrong value of each parameter is an `InputError` that names the parameter, or its row in the data."""
    if name == "instance" and door is solve:
        door = partial(solve, method="greedy")
    with pytest.raises(InputError) as caught:
        door(**{name: value})
    place = caught.value.place
    rows = {"communication_range": "range", "allowed_tasks": "tasks", "agent_ids": "id", "task_ids": "id"}
    assert (
        place == name
        or place.startswith(name)
        or place.endswith(f".{rows.get(name, name.split('_')[-1])}")
        or (place.endswith(f".{name}"))
    ), str(caught.value)


def test_equivalent_types_are_accepted(tmp_path):
    """NumPy numbers, a dict of ids or a result as start, and pandas's missing values are accepted."""
    plain = run(seed=3, iterations=5, objective="makespan")
    other = run(seed=np.int64(3), iterations=np.int32(5), objective=np.str_("makespan"), threads=np.int8(1))
    assert other.allocation == plain.allocation
    assert json.loads(json.dumps(other.to_dict()))["seed"] == 3
    for start in (plain, plain.allocation, plain.allocation.to_ids(SMALL)):
        assert run(start=start).makespan <= plain.makespan
    column = make(battery=[None, NAN, 5], speed=np.array([None, 1, NAN], object), start_task=[0.0, NAN, None])
    assert column.battery.tolist() == [INF, INF, 5]
    assert column.speed.tolist() == [INF, 1, INF]
    assert column.start_task.tolist() == [0, -1, -1]
    assert SMALL.without_agents(name for name in ("a1", "a3")).agent_ids == ("a2",)
    assert Allocation(np.array([1.0, -1.0])).task_of_agent.tolist() == [1, -1]


@pytest.mark.parametrize("copied", [deepcopy, lambda value: pickle.loads(pickle.dumps(value))])
def test_copies_are_read_only(copied):
    """Pickled and copied objects are read-only, too."""
    instance = copied(make(allowed_tasks=[[0], None, [1, 2]]))
    allocation = copied(Allocation([0, 1, 2]))
    arrays = [instance.ability, instance.allowed_tasks[2], allocation.task_of_agent]
    assert not any(array.flags.writeable for array in (*arrays, copied(evaluate(SMALL, allocation)).coverage))


def test_all_errors_share_a_base_class():
    """One base class catches all deliberate errors, which are also the corresponding built-in exceptions."""
    for error, kind in (
        (InputError, ValueError),
        (RefusedError, ValueError),
        (MissingPackageError, InputError),
        (MissingPackageError, ImportError),
        (TrainingError, RuntimeError),
    ):
        assert issubclass(error, kind)
        assert issubclass(error, AllocError)
    again = pickle.loads(pickle.dumps(InputError("must be", "seed", "file")))
    assert (str(again), again.place) == ("file: seed: must be", "seed")
