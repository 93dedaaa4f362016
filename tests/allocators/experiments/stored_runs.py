"""Stores with artificial runs, for tests of reports."""

from dataclasses import replace
from pathlib import Path

from alloc.allocators import Budget
from alloc.allocators.experiments.store.outcome import Ending, Outcome
from alloc.allocators.experiments.store.plan import packed
from alloc.allocators.experiments.store.store import Store
from alloc.allocators.experiments.stored import planned
from alloc.problems import Allocation, Instance

ANGRY = '</script><img src=x onerror="document.body.textContent=1"><b>'
"""What must never be anything but text."""

MACHINE = "a processor, 4 of them, Linux"

TRACE = ((0.25, None, 3.0, None), (0.5, 1.0, 2.0, 0.8))

METHODS = {"greedy": ("greedy", {}), "ga": ("ga", {"population": 4}), "hedonic": ("hedonic", {})}


def ending(number: int, label: str, seed: int, bound: float | None) -> Ending:
    """Return how a run ended: `greedy` needs 1 hour, `ga` 1.5 and fails once, `hedonic` refuses."""
    if label == "hedonic":
        return Ending(outcome=Outcome.REFUSED, reason="it is too large", revision="abc+")
    if (number, label, seed) == (3, "ga", 1):
        return Ending(outcome=Outcome.FAILED, reason="ValueError: no", details=f"Traceback\n{ANGRY}")
    makespan = 1.0 if label == "greedy" else 1.5
    trace = tuple((time, found and makespan, energy, bound) for time, found, energy, _ in TRACE)
    scores = {"makespan": makespan, "energy": 2.0 * makespan, "lower_bound": bound, "unserved": 0}
    used = {"runtime_s": 0.5, "memory_mb": 100.0}
    return Ending(outcome=Outcome.SOLVED, status="feasible", trace=trace, **scores, **used)


def fill(
    path: Path,
    *,
    instances: int = 4,
    methods: list[str] | None = None,
    bound: float | None = 0.8,
    time_limit_s: float = 1.0,
) -> None:
    """Write a store with the runs of some methods on instances, with two seeds each; one has a name with tags."""
    problems = [
        Instance(
            name=ANGRY if number == 0 else f"i{number}",
            ability=[1, 2, 3],
            agent_position=[[0, 0], [0, 1], [3 + number, 0]],
            workload=[3, 3],
            task_position=[[0, 0], [3, 1]],
        )
        for number in range(instances)
    ]
    wanted = {label: METHODS[label] for label in methods or METHODS}
    with Store(path) as store:
        budget = Budget(time_limit_s)
        plan = planned(store, problems, wanted, [0, 1], objective="makespan-energy", budget=budget, machine=MACHINE)
        for begin, ((number, label, seed), job) in enumerate(plan.jobs.items()):
            assert store.claim([job.run.key]).key == job.run.key
            allocation = Allocation([0, 0, 1] if label == "greedy" else [0, 0, 0])
            ended = replace(ending(number, label, seed, bound), started_at=1e9 + begin, finished_at=1e9 + begin)
            store.finish(job.run, ended, packed(allocation))
