"""Comparison of methods on instances and seeds: one row per method and instance."""

import threading
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial

from alloc.allocators.contract.base import Allocator
from alloc.allocators.contract.budget import Budget, StopReason
from alloc.allocators.contract.parameters import labelled_method
from alloc.allocators.contract.tolerance import relative_gap
from alloc.allocators.experiments.store.outcome import Ending
from alloc.allocators.experiments.sweep import by_label, load_failure, mean_and_worst, sweep
from alloc.allocators.registry import load
from alloc.allocators.request import checked_objective, checked_threads
from alloc.allocators.result import Result
from alloc.allocators.solve import solve
from alloc.problems import InputError, Instance, Objective
from alloc.problems.arguments import checked_seed, event, listed, of_type


@dataclass(frozen=True, kw_only=True)
class Row:
    """Results of one method on one instance, over all seeds.

    Attributes
    ----------
    instance, method : str
    picked : str
        The method that ``auto`` picked; empty for other methods.
    agents, tasks : int
    runs : int
        Number of runs; 0 after a refusal.
    statuses : str
        The distinct statuses of the runs, separated by ``/``.
    unserved : int or None
        Maximum number of unserved tasks in a run.
    makespan_mean, makespan_worst : float or None
        In hours; None, like bounds and gaps, if a run left a task unserved.
    lower_bound : float or None
        Best bound on the makespan that a run proved.
    gap_mean, gap_worst : float or None
        Gap of the makespan of each run to the bound that this run proved; see `share_bounds`.
    energy_mean, energy_worst : float or None
    runtime_mean_s, runtime_worst_s : float or None
    reason : str
        Why there are no results: a refusal, a missing package, or a failure.
    number : int
        Number of the instance, from 1, as names need not be unique.
    makespans : tuple of float
        Makespan of each run that served all tasks; not in `to_dict`.
    """

    instance: str
    method: str
    agents: int
    tasks: int
    picked: str = ""
    runs: int = 0
    statuses: str = ""
    unserved: int | None = None
    makespan_mean: float | None = None
    makespan_worst: float | None = None
    lower_bound: float | None = None
    gap_mean: float | None = None
    gap_worst: float | None = None
    energy_mean: float | None = None
    energy_worst: float | None = None
    runtime_mean_s: float | None = None
    runtime_worst_s: float | None = None
    reason: str = ""
    number: int = 1
    makespans: tuple[float, ...] = ()

    def to_dict(self) -> dict[str, object]:
        """Return the fields by name, ready for JSON.

        Returns
        -------
        dict
        """
        return {name: value for name, value in asdict(self).items() if name != "makespans"}


Methods = Sequence[str | Allocator] | Mapping[str, str | Allocator]
"""Names of methods, or allocators; in a mapping, by their label in the rows."""


def compare(
    instances: Iterable[Instance],
    methods: Methods,
    seeds: Sequence[int] = (0,),
    *,
    objective: Objective | str = Objective.MAKESPAN,
    time_limit_s: float | None = 10.0,
    iterations: int | None = None,
    target_gap: float | None = None,
    threads: int | None = None,
    stop: threading.Event | None = None,
) -> Iterator[Row]:
    """Run every method on every instance with every seed.

    Parameters
    ----------
    instances : iterable of Instance
    methods : sequence or dict
        Names, each of which is loaded once, and allocators with their own parameters, whose labels in the rows are
        such as ``ga[population=20]``. The keys of a dict are custom labels:
        ``{"small": GeneticAlgorithm(population=20), "large": GeneticAlgorithm(population=200)}``.
    seeds : sequence of int
    objective, time_limit_s, iterations, target_gap, threads
        As in `solve`; the budget applies to each run.
    stop : threading.Event, optional
        Ends the comparison when set; the run in progress is discarded.

    Returns
    -------
    iterator of Row
        Each row as soon as its runs are complete. If a method refuses an instance, is not installed, or fails, its
        row has the reason; the traceback of a failure goes to the logger ``alloc``.

    Raises
    ------
    InputError
        If an argument is invalid; `place` names the parameter.
    """
    given = by_label(methods, Allocator, _label, "methods")  # type: ignore[type-abstract]
    numbers = [checked_seed(seed, "seeds") for seed in listed(seeds, "seeds", "whole numbers")]
    problems = instances if isinstance(instances, Iterator) else listed(instances, "instances", "instances")
    Budget(time_limit_s, iterations, target_gap)
    stop = event(stop, "stop") or threading.Event()
    run = partial(
        solve,
        objective=checked_objective(objective),
        time_limit_s=time_limit_s,
        iterations=iterations,
        target_gap=target_gap,
        threads=checked_threads(threads),
        stop=stop,
        handle_signals=False,
    )
    loaded = {label: _load(method) if isinstance(method, str) else method for label, method in given.items()}
    checked = (of_type(instance, Instance, "instances") for instance in problems)
    return (
        replace(summarise(one.problem, one.label, one.results, one.reason), number=one.number)
        for one in sweep(partial(_run, run), checked, loaded, numbers, stop)
    )


def _label(method: Allocator) -> str:
    """Return the label of an allocator in the rows, such as ``ga[population=20]``."""
    return labelled_method(method.method.name, method.changed_parameters())


def _run(run: Callable[..., Result], instance: Instance, method: str | Allocator, seed: int) -> Result | None:
    """Return the result of a run, or None if it was interrupted."""
    result = run(instance, method, seed=seed)
    return None if result.stop_reason is StopReason.INTERRUPTED else result


def summarise(instance: Instance, method: str, results: Sequence[Result], reason: str = "") -> Row:
    """Return the row of one method on one instance.

    Parameters
    ----------
    results : sequence of Result
        One per seed.
    reason : str
        Why there are no results.
    """
    row = Row(instance=instance.name, method=method, agents=instance.n, tasks=instance.m, reason=reason)
    scores = [result.evaluation for result in results]
    unserved = [instance.m if score is None else len(score.unserved_tasks) for score in scores]
    return with_figures(row, results, [result.method for result in results], unserved) if results else row


def with_figures(row: Row, runs: Sequence[Result | Ending], picked: Sequence[str], unserved: Sequence[int]) -> Row:
    """Return a copy of a row with the results of runs filled in.

    Parameters
    ----------
    row : Row
        Row without results.
    runs : sequence of Result or Ending
        At least one; all of them have a result.
    picked : sequence of str
        Method that each run used.
    unserved : sequence of int
        Number of unserved tasks of each run.
    """
    makespan, gap, energy, runtime = (
        mean_and_worst([getattr(run, name) for run in runs]) for name in ("makespan", "gap", "energy", "runtime_s")
    )
    return replace(
        row,
        picked="/".join(sorted(set(picked))) if row.method == "auto" else "",
        runs=len(runs),
        statuses="/".join(sorted({str(run.status) for run in runs})),
        unserved=max(unserved),
        makespan_mean=makespan[0],
        makespan_worst=makespan[1],
        lower_bound=max((run.lower_bound for run in runs if run.lower_bound is not None), default=None),
        gap_mean=gap[0],
        gap_worst=gap[1],
        energy_mean=energy[0],
        energy_worst=energy[1],
        runtime_mean_s=runtime[0],
        runtime_worst_s=runtime[1],
        makespans=tuple(run.makespan for run in runs if run.makespan is not None),
    )


def share_bounds(rows: Sequence[Row]) -> list[Row]:
    """Return the rows with all gaps computed from the best bound that any method proved on the instance.

    A bound holds for every method; with its own bound, a method that proves little would look worse than it is.

    Parameters
    ----------
    rows : sequence of Row

    Returns
    -------
    list of Row
    """
    best: dict[int, float] = {}
    for row in rows:
        if row.lower_bound is not None:
            best[row.number] = max(row.lower_bound, best.get(row.number, 0.0))
    return [row if row.gap_mean is None else _against(row, best[row.number]) for row in rows]


def _against(row: Row, bound: float) -> Row:
    gap_mean, gap_worst = mean_and_worst([relative_gap(makespan, bound) for makespan in row.makespans])
    return replace(row, lower_bound=bound, gap_mean=gap_mean, gap_worst=gap_worst)


def _load(name: str) -> str | Allocator | Exception:
    """Load a method once; `auto` stays a name, and an error is returned for the rows."""
    if name == "auto":
        return name
    try:
        return load(name)
    except InputError as error:
        return error
    except Exception as error:  # a faulty plugin must not affect other methods
        return load_failure(f"method {name!r}", error)
