"""A comparison in a store: which runs it consists of, and its rows from those that have ended."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from alloc.allocators.contract.budget import Budget
from alloc.allocators.experiments.campaign import Job
from alloc.allocators.experiments.compare import Row
from alloc.allocators.experiments.store.key import Run, canonical, this_machine, versions
from alloc.allocators.experiments.store.outcome import Ending, Outcome
from alloc.allocators.experiments.store.store import Store
from alloc.allocators.experiments.sweep import mean_and_worst
from alloc.allocators.request import checked_objective, checked_seed, checked_threads
from alloc.problems import Instance, Objective
from alloc.problems.text import counted, percent

ENOUGH = 0.9
"""Share of a processor below which the time that a run was given is not to be believed."""

LONG_S = 0.1
"""Seconds from which on a run's processor time says how much of a processor it had."""

Variants = Mapping[str, tuple[str, Mapping[str, object]]]
"""Name and parameters of a method, by the name that it has in the rows."""

Endings = Mapping[str, Sequence[Sequence[Ending | None]]]
"""How runs ended, by method, instance and seed; None where one has not."""


@dataclass(frozen=True)
class Comparison:
    """What is compared.

    Attributes
    ----------
    instances : sequence of Instance
    seeds : sequence of int
    jobs : dict
        The run of each number of an instance, name of a method in the rows, and seed: in the order in which they are
        made. Methods take turns, so that what else the machine does meanwhile hits all alike.
    """

    instances: Sequence[Instance]
    seeds: Sequence[int]
    jobs: Mapping[tuple[int, str, int], Job]

    @property
    def methods(self) -> list[str]:
        """Names of the methods in the rows."""
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
                    _told(name, value)
                    for name, value, own in zip(CONDITION_NAMES, conditions, base, strict=True)
                    if value != own
                ]
                found.append(f"{counted(count, 'run')} with {', '.join(differs)}")
        return found


CONDITION_NAMES = ("objective", "time limit", "iterations", "target gap", "threads", "version", "machine")
"""What is told of `CONDITIONS` of a store."""


def _conditions(run: Run) -> tuple[object, ...]:
    limits = (run.time_limit_s, run.iterations, run.target_gap)
    return (run.objective, *limits, run.threads, run.version, run.machine)


def _told(name: str, value: object) -> str:
    return f"no {name}" if value is None else f"{name} {value}"


def planned(
    store: Store,
    instances: Sequence[Instance],
    methods: Variants,
    seeds: Sequence[int],
    *,
    objective: Objective | str = Objective.MAKESPAN,
    budget: Budget,
    threads: int | None = None,
) -> Comparison:
    """Return all runs of a comparison, and note the instances in the store.

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

    Raises
    ------
    InputError
        If an argument is not what it should be; its place is the parameter.
    """
    goal, each = checked_objective(objective), checked_threads(threads) or 1
    hashes = [store.add_instance(instance) for instance in instances]
    known = {label: (name, canonical(settings), versions(name)) for label, (name, settings) in methods.items()}
    jobs = {}
    for number, (instance, hashed) in enumerate(zip(instances, hashes, strict=True)):
        for seed in seeds:
            for label, (name, parameters, version) in known.items():
                run = Run(
                    instance=hashed,
                    method=name,
                    parameters=parameters,
                    seed=checked_seed(seed, "seeds"),
                    objective=str(goal),
                    time_limit_s=None if budget.time_limit_s is None else float(budget.time_limit_s),
                    iterations=budget.iterations,
                    target_gap=None if budget.target_gap is None else float(budget.target_gap),
                    threads=each,
                    version=version,
                    machine=this_machine(),
                )
                jobs[number, label, seed] = Job(run, dict(methods[label][1]), instance)
    return Comparison(instances, seeds, jobs)


def rows_of(comparison: Comparison, endings: Endings) -> list[Row]:
    """Return a row per instance and method, as `compare` does, of the runs that have ended.

    A method with a run that was not solved has a row with the reason: a mean over the others would be too good.
    """
    return [
        replace(_row(instance, label, endings[label][number], comparison.seeds), number=number + 1)
        for number, instance in enumerate(comparison.instances)
        for label in comparison.methods
        if any(endings[label][number])
    ]


def _row(instance: Instance, label: str, endings: Sequence[Ending | None], seeds: Sequence[int]) -> Row:
    empty = Row(instance=instance.name, method=label, agents=instance.n, tasks=instance.m)
    for seed, ending in zip(seeds, endings, strict=True):
        if ending is not None and ending.outcome is not Outcome.SOLVED:
            return replace(empty, reason=reason(ending, seed))
    ended = [ending for ending in endings if ending is not None]
    makespan, gap, energy, runtime = (
        mean_and_worst([getattr(ending, name) for ending in ended])
        for name in ("makespan", "gap", "energy", "runtime_s")
    )
    return replace(
        empty,
        picked="/".join(sorted({ending.picked for ending in ended})) if label == "auto" else "",
        runs=len(ended),
        statuses="/".join(sorted({ending.status for ending in ended})),
        unserved=max(ending.unserved or 0 for ending in ended),
        makespan_mean=makespan[0],
        makespan_worst=makespan[1],
        lower_bound=max((one.lower_bound for one in ended if one.lower_bound is not None), default=None),
        gap_mean=gap[0],
        gap_worst=gap[1],
        energy_mean=energy[0],
        energy_worst=energy[1],
        runtime_mean_s=runtime[0],
        runtime_worst_s=runtime[1],
        makespans=tuple(ending.makespan for ending in ended if ending.makespan is not None),
    )


def reason(ending: Ending, seed: int) -> str:
    """Return why a run has no result, in a line."""
    if ending.outcome in (Outcome.REFUSED, Outcome.MISSING_PACKAGE):
        return ending.reason
    return f"{ending.outcome} with seed {seed}: {ending.reason}"


def doubts(endings: Endings) -> list[str]:
    """Return why the figures may not be what they should, in a sentence each: runs that had to share processors."""
    runs = [ending for lists in endings.values() for some in lists for ending in some if ending is not None]
    timed = [one for one in runs if one.cores and one.cpu_s is not None and (one.runtime_s or 0.0) >= LONG_S]
    poor = sum((one.cpu_s or 0.0) < ENOUGH * (one.runtime_s or 0.0) for one in timed)
    if not poor:
        return []
    share = f"{poor} of {counted(len(timed), 'timed run')}"
    return [f"{share} had less than {percent(ENOUGH)} of a processor: was the machine busy, or does the method wait?"]
