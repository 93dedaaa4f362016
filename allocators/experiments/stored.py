"""A comparison in a store: which runs it consists of, and its rows from those that have ended."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from alloc.allocators.contract.budget import Budget
from alloc.allocators.experiments.campaign import Job
from alloc.allocators.experiments.compare import Row, with_figures
from alloc.allocators.experiments.store.key import Run, canonical, this_machine, versions
from alloc.allocators.experiments.store.outcome import Ending, Outcome
from alloc.allocators.experiments.store.store import CONDITIONS, Store
from alloc.allocators.request import checked_objective, checked_seed, checked_threads
from alloc.problems import Instance, Mission, Objective
from alloc.problems.arguments import of_type
from alloc.problems.text import counted, percent

ENOUGH = 0.9
"""Share of a processor below which the time that a run was given is not to be believed."""

LONG_S = 0.1
"""Seconds from which on a run's processor time says how much of a processor it had."""

Variants = Mapping[str, tuple[str, Mapping[str, object]]]
"""Name and parameters of a method or policy, by the name that it has in the rows."""

Endings = Mapping[str, Sequence[Sequence[Ending | None]]]
"""How runs ended, by method or policy, instance or mission, and seed; None where one has not."""


@dataclass(frozen=True)
class Comparison:
    """What is compared.

    Attributes
    ----------
    instances : sequence of Instance or Mission
    seeds : sequence of int
    jobs : dict
        The run of each number of an instance, name of a method in the rows, and seed: in the order in which they are
        made. Methods take turns, so that what else the machine does meanwhile hits all alike.
    """

    instances: Sequence[Instance | Mission]
    seeds: Sequence[int]
    jobs: Mapping[tuple[int, str, int], Job]

    @property
    def methods(self) -> list[str]:
        """Names of the methods or policies in the rows."""
        return list(dict.fromkeys(label for _, label, _ in self.jobs))

    def endings(self, store: Store) -> Endings:
        """Return how the runs ended, as far as they have."""
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
        """Return in words which runs the store holds that were made under other conditions than these."""
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
"""What some of `CONDITIONS` are called, where that is not their own name."""


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
    """Return all runs of a comparison of methods, and note the instances in the store.

    Parameters
    ----------
    store : Store
    instances : sequence of Instance
    methods : mapping
        See `Variants`.
    seeds : sequence of int
    objective : Objective or str
    budget : Budget
        Of each run.
    threads : int, optional
        Of each run; one by default, whatever the machine has.
    machine : str, optional
        Where the runs are made; this one by default.

    Raises
    ------
    InputError
        If an argument is not what it should be; its place is the parameter.
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
    """Return all runs of a comparison, and note the problems in the store.

    Parameters
    ----------
    store : Store
    problems : sequence
        Instances or missions, each with what all runs on it have in common.
    compared : mapping
        See `Variants`.
    seeds : sequence of int
    packages : mapping
        Versions of what is compared, by its name.
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
    """Return a row per instance and method, as `compare` does, of the runs that have ended.

    A method with a run that was not solved has a row with the reason: a mean over the others would be too good.
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
    """Return why one of some runs has no result, in a line; empty if all that have ended have one."""
    for seed, ending in zip(seeds, endings, strict=True):
        if ending is not None and ending.outcome is not Outcome.SOLVED:
            is_told = ending.outcome in (Outcome.REFUSED, Outcome.MISSING_PACKAGE)
            return ending.reason if is_told else f"{ending.outcome} with seed {seed}: {ending.reason}"
    return ""


def doubts(endings: Endings) -> list[str]:
    """Return why the figures may not be what they should, in a sentence each: runs that had to share processors."""
    runs = [ending for lists in endings.values() for some in lists for ending in some if ending is not None]
    timed = [one for one in runs if one.cores and one.cpu_s is not None and (one.runtime_s or 0.0) >= LONG_S]
    poor = sum((one.cpu_s or 0.0) < ENOUGH * (one.runtime_s or 0.0) for one in timed)
    if not poor:
        return []
    share = f"{poor} of {counted(len(timed), 'timed run')}"
    return [f"{share} had less than {percent(ENOUGH)} of a processor: was the machine busy, or does the method wait?"]
