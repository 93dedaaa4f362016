"""With far more tasks than agents, as many as possible are served within the time limit."""

import time
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import maximum_bipartite_matching

from alloc.allocators import solve
from alloc.problems import IDLE, Allocation, Instance, evaluate, fewest_unserved, find_shortage, serve_all
from alloc.problems.matching.clock import at_least, share_of, unlimited
from alloc.problems.matching.hopcroft_karp import largest_matching, match
from alloc.problems.matching.pairs import bound_by_size, sampled_pairs


def surplus_of_tasks(reach: float | None, agents: int = 2_000, tasks: int = 20_000) -> Instance:
    """Return agents and tasks at random places in the unit square."""
    rng = np.random.default_rng(1)
    return Instance(
        ability=rng.integers(1, 10, agents),
        workload=rng.integers(10, 1000, tasks),
        agent_position=rng.random((agents, 2)),
        task_position=rng.random((tasks, 2)),
        communication_range=None if reach is None else np.full(agents, reach),
    )


@pytest.mark.parametrize("reach", [0.1, 0.5])
@pytest.mark.parametrize("method", ["greedy", "local-search"])
def test_time_limit_is_respected_and_agents_serve_small_tasks(reach: float, method: str) -> None:
    """Each of 2,000 agents serves one of 20,000 tasks after 1.6 s of processor time at most, and not the largest."""
    solve(surplus_of_tasks(reach, 20, 200), method, time_limit_s=0.1)  # loads what is compiled
    instance = surplus_of_tasks(reach)
    begin_s = time.process_time()  # a busy machine is no bug
    result = solve(instance, method, time_limit_s=1, threads=1)
    assert time.process_time() - begin_s <= 1.6
    assert result.evaluation is not None
    assert len(result.evaluation.unserved_tasks) == 18_000
    bound = bound_by_size(instance, np.arange(instance.n), np.arange(instance.m))
    assert result.evaluation.served_makespan <= 10 * bound
    assert any("only 2000 agents can take any of the 2001 tasks" in note for note in result.notes)


def test_zero_time_gives_a_note() -> None:
    """Without time some tasks are served, and a note says that more might be possible."""
    instance = surplus_of_tasks(0.02)
    result = solve(instance, "greedy", time_limit_s=0)
    assert result.evaluation is not None
    assert len(result.evaluation.unserved_tasks) < 19_500
    assert any("before it was proven that no plan serves more tasks" in note for note in result.notes)


@given(st.integers(0, 10**6))
def test_distant_surpluses_of_agents_and_tasks_are_matched(seed: int) -> None:
    """With idle agents in one place and unserved tasks in another, a run without a table serves the most tasks."""
    rng = np.random.default_rng(seed)
    instance = surplus_of_tasks(0.15, 30, 60)
    lists = [None if rng.random() < 0.7 else rng.integers(0, 60, 2).tolist() for _ in range(30)]
    instance = Instance(
        ability=instance.ability,
        workload=instance.workload,
        agent_position=rng.random((30, 2)),
        task_position=rng.random((60, 2)),
        communication_range=instance.communication_range,
        allowed_tasks=lists,
    )
    with pytest.MonkeyPatch.context() as patch:
        expected = fewest_unserved(instance)
        patch.setattr("alloc.problems.distances.reach.TABLE_LIMIT", -1)
        patch.setattr("alloc.problems.matching.agent_matching.LONGEST_S", 1e-5)
        patch.setattr("alloc.problems.matching.agent_matching.SHORTEST_S", 1e-5)  # a sample of a few pairs
        assert fewest_unserved(instance) == expected
        shortage = find_shortage(instance)
        assert shortage is not None
        assert shortage.is_proven
        assert len(shortage.tasks) - len(shortage.agents) == expected
        assert len(evaluate(instance, shortage.merged()).violations) == 0


@given(st.integers(0, 10**6))
def test_hopcroft_and_karp_agree_with_scipy(seed: int) -> None:
    """The matching is valid, can start from any other, and is as large as SciPy's."""
    rng = np.random.default_rng(seed)
    rows, columns = rng.integers(1, 12, 2)
    row, column = np.nonzero(rng.random((rows, columns)) < rng.random())
    first = np.searchsorted(row, np.arange(rows + 1))
    start = np.full(rows, IDLE)
    some = rng.permutation(len(row))[:1]
    start[row[some]] = column[some]
    found, is_largest = largest_matching(first, column, start, lambda: np.inf)
    served = np.flatnonzero(found != IDLE)
    assert is_largest
    graph = csr_matrix((np.ones(len(column)), column, first), (rows, columns))
    size = (maximum_bipartite_matching(graph, perm_type="column") != IDLE).sum()
    assert len(served) == size
    other, is_largest = match(first, column)  # from the side with fewer
    assert is_largest
    assert (other != IDLE).sum() == len(set(other[other != IDLE])) == size
    assert all(other[i] in column[first[i] : first[i + 1]] for i in np.flatnonzero(other != IDLE))
    assert len(set(found[served])) == len(served)
    assert all(found[i] in column[first[i] : first[i + 1]] for i in served)


def test_samples_contain_pairs_of_every_size() -> None:
    """With small budgets each agent has small and large tasks; with large budgets, all pairs."""
    instance = surplus_of_tasks(0.5, 400, 5_000)
    agents, tasks = np.arange(400), np.arange(5_000)
    few, is_all = sampled_pairs(instance, agents, tasks, None, 0.02, lambda: np.inf)
    assert not is_all
    work = instance.workload[few.task]
    assert (np.minimum.reduceat(work, few.first[:-1]) < 100).mean() > 0.9
    assert (np.maximum.reduceat(work, few.first[:-1]) > 500).mean() > 0.9
    every, _ = sampled_pairs(instance, agents, tasks, None, 100.0, lambda: np.inf)
    assert len(every.task) > 5 * len(few.task)


def looks(number: int) -> Callable[[], float]:
    """Return a clock that runs out after a number of calls."""
    left = iter([1.0] * number)
    return lambda: next(left, 0.0)


@pytest.mark.parametrize("number", [0, 1, 2, 5, 20])
def test_matching_ends_with_its_time(number: int) -> None:
    """When the clock runs out, a valid matching is returned that is not claimed to be maximum."""
    rng = np.random.default_rng(2)
    row, column = np.nonzero(rng.random((400, 400)) < 0.006)
    first = np.searchsorted(row, np.arange(401))
    found, is_largest = largest_matching(first, column, np.full(400, IDLE), looks(number))
    served = np.flatnonzero(found != IDLE)
    assert not is_largest
    assert 0 < len(served) < (match(first, column)[0] != IDLE).sum()
    assert len(set(found[served])) == len(served)
    assert all(found[i] in column[first[i] : first[i + 1]] for i in served)


def test_long_paths_respect_the_time_limit() -> None:
    """Computation of levels, and the search along a path through all rows, check the clock."""
    n = 1_000  # row i holds column i - 1 and can take column i besides; row 0 holds none
    first = np.concatenate([[0], 1 + 2 * np.arange(n)])
    column = np.concatenate([[0], (np.arange(1, n)[:, None] + [-1, 0]).ravel()])
    start = np.arange(-1, n - 1)
    assert (largest_matching(first, column, start, unlimited)[0] == np.arange(n)).all()
    for number in (n // 2, 2 * n + n // 32):  # within the levels, and along the path
        found, is_largest = largest_matching(first, column, start, looks(number))
        assert not is_largest
        assert (found == start).all()


@pytest.mark.parametrize("table", [True, False])
def test_serving_ends_with_its_time(table: bool) -> None:
    """When the clock runs out tasks stay unserved, served ones stay served; without a limit all are served."""
    rng = np.random.default_rng(3)
    place = rng.random((60, 2))
    instance = Instance(
        ability=np.ones(60),
        workload=np.ones(60),
        agent_position=place,
        task_position=place[rng.permutation(60)],
        communication_range=np.full(60, 0.3),
    )
    with pytest.MonkeyPatch.context() as patch:
        if not table:
            patch.setattr("alloc.problems.distances.reach.TABLE_LIMIT", -1)
            patch.setattr("alloc.problems.matching.serving.CHUNK", 8)  # those next to whom an agent is idle
        unserved = [
            len(evaluate(instance, serve_all(instance, Allocation.idle(instance), clock)).unserved_tasks)
            for clock in (looks(0), looks(40), unlimited)
        ]
    assert unserved[0] == 60 if table else 52 <= unserved[0] < 60
    assert 0 < unserved[1] < 60
    assert unserved[2] == 0


def test_no_proof_without_time(monkeypatch: pytest.MonkeyPatch) -> None:
    """Proving that tasks compete takes a matching; without time it is not claimed."""
    instance = surplus_of_tasks(0.1, 40, 30)
    assert find_shortage(instance) is not None
    assert find_shortage(instance, lambda: 0.0) is not None  # small: found out all the same
    monkeypatch.setattr("alloc.problems.matching.unservable.SHORTEST_S", 0.0)
    assert find_shortage(instance, lambda: 0.0) is None


def test_shares_and_minimums_of_time() -> None:
    """A share of the time ends before the time does, and a minimum time applies even without time left."""
    left = iter([10.0, 10.0, 6.0, 5.0])
    part = share_of(0.5, lambda: next(left))
    assert [part(), part(), part()] == [5.0, 1.0, 0.0]
    assert share_of(0.5, unlimited)() == np.inf
    assert 0 < at_least(5.0, lambda: 0.0)() <= 5.0
    assert at_least(5.0, unlimited)() == np.inf
