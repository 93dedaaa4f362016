import threading

import pytest

from alloc.allocators import Allocator, Method, Proposal, registry
from alloc.allocators.experiments.compare import compare, share_bounds
from alloc.problems import Allocation, Instance

SMALL = Instance(name="small", ability=[5, 2, 1, 8, 3], workload=[3, 13, 4])
PARTLY = Instance(name="partly", ability=[2, 3], workload=[4, 6], allowed_tasks=[[0], [0]])


class BySeed(Allocator):
    """Returns an allocation that depends on the seed, or fails."""

    method = Method(name="by-seed", summary="")

    def allocate(self, search):
        if search.seed == 9:
            raise ZeroDivisionError("nine")
        return Proposal(Allocation([[0, 0, 0, 1, 2], [0, 2, 2, 1, 1]][search.seed % 2]))


@pytest.fixture(autouse=True)
def by_seed(monkeypatch):
    monkeypatch.setitem(registry.BUILT_IN, "by-seed", BySeed.method)
    monkeypatch.setattr(registry, "TARGETS", {**registry.TARGETS, "by-seed": f"{__name__}:BySeed"})
    monkeypatch.setitem(__import__("sys").modules, __name__, __import__("types").SimpleNamespace(BySeed=BySeed))


def test_mean_and_worst_over_seeds():
    """A row holds the mean and the worst of its seeds."""
    (row,) = compare([SMALL], ["by-seed"], [0, 1])
    first, second = 13 / 8, 4 / 3
    assert row.runs == 2
    assert row.makespan_mean == pytest.approx((first + second) / 2)
    assert row.makespan_worst == pytest.approx(first)
    assert row.gap_worst == pytest.approx(1 - row.lower_bound / first)
    assert row.runtime_worst_s >= row.runtime_mean_s > 0


def test_no_mean_makespan_with_unserved_tasks():
    """If a run leaves a task unserved, there is no mean over the other runs, which would be biased."""
    (row,) = compare([PARTLY], ["greedy"])
    assert (row.unserved, row.makespan_mean, row.gap_mean, row.statuses) == (1, None, None, "infeasible")
    assert row.energy_mean == 0


def test_failures_are_rows():
    """A method that fails has a row with the reason, and the others continue."""
    failed, fine = compare([SMALL], ["by-seed", "greedy"], [9])
    assert failed.reason == "failed with seed 9: ZeroDivisionError: nine"
    assert (failed.runs, fine.runs) == (0, 1)


def test_missing_packages_are_rows(monkeypatch):
    """A method whose packages are missing has a row that says what to install."""
    monkeypatch.setattr("alloc.allocators.contract.method.find_spec", lambda name: None)
    (row,) = compare([SMALL], ["cpsat"])
    assert "pip install ortools" in row.reason


def test_auto_names_the_method_it_picked():
    """The row of `auto` names the method that ran."""
    (row,) = compare([SMALL], ["auto"])
    assert (row.method, row.picked) == ("auto", "cpsat")


def test_rows_are_yielded_lazily_until_a_stop_request():
    """Rows are yielded lazily; after a stop request, only complete rows are returned."""
    stop = threading.Event()
    rows = compare([SMALL, PARTLY], ["greedy"], stop=stop)
    assert next(rows).instance == "small"
    stop.set()
    assert list(rows) == []


def test_gaps_share_the_best_bound():
    """A bound of one method counts for all methods on that instance, but not for another instance of the same name."""
    lists = [[1, 2], [0], [0, 1, 2], [0, 1, 2], [1, 2]]
    hard = Instance(name="one", ability=[6, 7, 6, 5, 5], workload=[12, 8, 5], allowed_tasks=lists)
    easy = Instance(name="one", ability=[2, 2], workload=[1, 1])
    rows = list(compare([hard, easy], ["greedy", "cpsat"]))
    greedy, cpsat, *others = share_bounds(rows)
    assert rows[0].lower_bound < 0.92 < rows[1].lower_bound
    assert greedy.lower_bound == cpsat.lower_bound == pytest.approx(12 / 13)
    assert greedy.gap_mean == pytest.approx(1 - 12 / 13 / greedy.makespan_mean)
    assert greedy.gap_mean > 0.07
    assert cpsat.gap_worst == pytest.approx(0, abs=1e-6)
    assert [(row.lower_bound, row.number) for row in others] == [(0.5, 2), (0.5, 2)]


def test_tracebacks_of_failures_are_logged(caplog, monkeypatch):
    """A failed run is a row; its traceback is in the log of `alloc`."""

    def fail(*arguments, **options):
        raise ZeroDivisionError("in a plugin")

    monkeypatch.setattr("alloc.allocators.heuristic.greedy.list_schedule.Greedy.allocate", fail)
    (row,) = compare([Instance(ability=[1], workload=[1])], ["greedy"])
    assert "ZeroDivisionError" in row.reason
    assert caplog.records[0].exc_info[0] is ZeroDivisionError
    assert caplog.records[0].name.startswith("alloc")
