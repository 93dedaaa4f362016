"""Comparisons in a store: their runs, and their rows from the runs that have ended."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from alloc.allocators.contract.budget import Budget
from alloc.allocators.experiments.campaign import Job
from alloc.allocators.experiments.compare import Row, with_figures
from alloc.allocators.experiments.store.key import Run, canonical, this_machine, versions
from alloc.allocators.experiments.store.outcome import Ending, Outcome
from alloc.allocators.experiments.store.store import CONDITIONS, Store
from alloc.allocators.request import checked_objective, checked_threads
from alloc.problems import Instance, Mission, Objective
from alloc.problems.arguments import checked_seed, of_type
from alloc.problems.text import counted, percent

ENOUGH = 0.9
"""Share of a processor below which the time limit of a run is not reliable."""

LONG_S = 0.1
"""Minimum duration of a run for which its share of a processor is checked."""

Variants = Mapping[str, tuple[str, Mapping[str, object]]]
"""Name and parameters of each method or policy, by its label in the rows."""

Endings = Mapping[str, Sequence[Sequence[Ending | None]]]
"""Endings of runs, by method or policy, instance or mission, and seed; None for runs that have not ended."""


@dataclass(frozen=True)
class Comparison:
    """The runs of a comparison.

    Attributes
    ----------
    instances : sequence of Instance or Mission
    seeds : sequence of int
    jobs : dict
        The run of each instance number, label and seed, in order of execution. Methods alternate, so that other load
        on the machine affects them equally.
    """

    instances: Sequence[Instance | Mission]
    seeds: Sequence[int]
    jobs: Mapping[tuple[int, str, int], Job]

    @property
    def methods(self) -> list[str]:
        """Labels of the methods or policies in the rows."""
        return list(dict.fromkeys(label for _, label, _ in self.jobs))

    def endings(self, store: Store) -> Endings:
        """Return the endings of the runs that have ended."""
        keys = {place: job.run.key for place, job in self.jobs.items()}
        records = store.records(list(set(keys.values())))

        def ending(place: tuple[int, str, int]) -> Ending | None:
            record = records.get(keys[place])
            return None if record is None else record.ending

        numbers = range(len(self.instances))
        return {
            label: [[ending((number, label, seed)) for seed in self.seeds] for number in numbers]
            for label in self.methods
        }

    def others(self, store: Store) -> list[str]:
        """Return descriptions of the runs in the store that were made under other conditions."""
        ours = {_conditions(job.run) for job in self.jobs.values()}
        base = next(iter(ours), ())
        found = []
        for conditions, count in store.settings().items():
            if conditions not in ours:
                differs = [
                    _told(CONDITION_NAMES.get(name, name), value)
                    for name, value, own in zip(CONDITIONS, conditions, base, strict=True)
                    if value != own
                ]
                found.append(f"{counted(count, 'run')} with {', '.join(differs)}")
        return found


CONDITION_NAMES = {"time_limit_s": "time limit", "target_gap": "target gap", "deadline_ms": "deadline"}
"""Names of those `CONDITIONS` whose text differs from the field name."""


def _conditions(run: Run) -> tuple[object, ...]:
    return tuple(getattr(run, name) for name in CONDITIONS)


def _told(name: str, value: object) -> str:
    return f"no {name}" if value in (None, "") else f"{name} {value}"


def planned(
    store: Store,
    instances: Sequence[Instance],
    methods: Variants,
    seeds: Sequence[int],
    *,
    objective: Objective | str = Objective.MAKESPAN,
    budget: Budget,
    threads: int | None = None,
    machine: str | None = None,
) -> Comparison:
    """Return all runs of a comparison of methods, and add the instances to the store.

    Parameters
    ----------
    store : Store
    instances : sequence of Instance
    methods : mapping
        See `Variants`.
    seeds : sequence of int
    objective : Objective or str
    budget : Budget
        Budget of each run.
    threads : int, optional
        Threads of each run; by default one, on any machine.
    machine : str, optional
        Machine that executes the runs; by default this one.

    Raises
    ------
    InputError
        If an argument is invalid; `place` names the parameter.
    """
    common = Run(
        objective=str(checked_objective(objective)),
        time_limit_s=None if budget.time_limit_s is None else float(budget.time_limit_s),
        iterations=budget.iterations,
        target_gap=None if budget.target_gap is None else float(budget.target_gap),
        threads=checked_threads(threads) or 1,
        machine=machine or this_machine(),
    )
    packages = {name: versions(name) for name, _ in methods.values()}
    numbers = [checked_seed(seed, "seeds") for seed in seeds]
    return plan(store, [(instance, common) for instance in instances], methods, numbers, packages)


def plan(
    store: Store,
    problems: Sequence[tuple[Instance | Mission, Run]],
    compared: Variants,
    seeds: Sequence[int],
    packages: Mapping[str, str],
) -> Comparison:
    """Return all runs of a comparison, and add the problems to the store.

    Parameters
    ----------
    store : Store
    problems : sequence
        Instances or missions, each with a run that has the fields common to all runs on it.
    compared : mapping
        See `Variants`.
    seeds : sequence of int
    packages : mapping
        Version of each method or policy, by name.
    """
    hashes = [store.add(problem) for problem, _ in problems]
    known = {label: (name, canonical(settings), packages[name]) for label, (name, settings) in compared.items()}
    jobs = {}
    for number, ((problem, common), hashed) in enumerate(zip(problems, hashes, strict=True)):
        for seed in seeds:
            for label, (name, parameters, version) in known.items():
                own = replace(common, instance=hashed, method=name, parameters=parameters)
                run = replace(own, version=version, seed=seed)
                jobs[number, label, seed] = Job(run, dict(compared[label][1]), problem)
    return Comparison([problem for problem, _ in problems], seeds, jobs)


def rows_of(comparison: Comparison, endings: Endings) -> list[Row]:
    """Return a row per instance and method, as `compare` does, from the runs that have ended.

    If a run of a method has no result, its row has the reason instead, as a mean over the other runs would be biased.
    """
    return [
        replace(
            _row(of_type(instance, Instance, "instances"), label, endings[label][number], comparison.seeds),
            number=number + 1,
        )
        for number, instance in enumerate(comparison.instances)
        for label in comparison.methods
        if any(endings[label][number])
    ]


def _row(instance: Instance, label: str, endings: Sequence[Ending | None], seeds: Sequence[int]) -> Row:
    empty = Row(instance=instance.name, method=label, agents=instance.n, tasks=instance.m)
    if why := unsolved(endings, seeds):
        return replace(empty, reason=why)
    ended = [ending for ending in endings if ending is not None]
    return with_figures(empty, ended, [one.picked for one in ended], [one.unserved or 0 for one in ended])


def unsolved(endings: Sequence[Ending | None], seeds: Sequence[int]) -> str:
    """Return why one of the runs has no result, in one line; empty if all runs that have ended have one."""
    for seed, ending in zip(seeds, endings, strict=True):
        if ending is not None and ending.outcome is not Outcome.SOLVED:
            is_told = ending.outcome in (Outcome.REFUSED, Outcome.MISSING_PACKAGE)
            return ending.reason if is_told else f"{ending.outcome} with seed {seed}: {ending.reason}"
    return ""


def doubts(endings: Endings) -> list[str]:
    """Return warnings about the reliability of the results, one sentence each: runs that had to share processors."""
    runs = [ending for lists in endings.values() for some in lists for ending in some if ending is not None]
    timed = [one for one in runs if one.cores and one.cpu_s is not None and (one.runtime_s or 0.0) >= LONG_S]
    poor = sum((one.cpu_s or 0.0) < ENOUGH * (one.runtime_s or 0.0) for one in timed)
    if not poor:
        return []
    share = f"{poor} of {counted(len(timed), 'timed run')}"
    return [f"{share} had less than {percent(ENOUGH)} of a processor: was the machine busy, or does the method wait?"]
