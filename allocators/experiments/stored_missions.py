"""Comparisons of policies in a store: their runs, and their rows from the runs that have ended."""

import json
from collections.abc import Sequence
from dataclasses import fields, replace

from alloc.allocators.experiments.policies import PolicyRow, summarise_runs
from alloc.allocators.experiments.store.key import MISSION, Run, this_machine, versions
from alloc.allocators.experiments.store.outcome import Ending
from alloc.allocators.experiments.store.store import Store
from alloc.allocators.experiments.stored import Comparison, Endings, Variants, plan, unsolved
from alloc.allocators.online.registry import ENTRY_POINT_GROUP, POLICIES
from alloc.problems import Mission, MissionResult
from alloc.problems.arguments import checked_seed, choice, of_type, real
from alloc.problems.vocabulary import Knowledge


def planned_missions(
    store: Store,
    missions: Sequence[Mission],
    policies: Variants,
    seeds: Sequence[int],
    *,
    knowledge: Knowledge | str | None = None,
    deadline_ms: float | None = None,
    machine: str | None = None,
) -> Comparison:
    """Return all runs of a comparison of policies, and add the missions to the store.

    Parameters
    ----------
    store : Store
    missions : sequence of Mission
    policies : mapping
        See `Variants`.
    seeds : sequence of int
    knowledge, deadline_ms
        As in `simulate`.
    machine
        As in `planned`.

    Raises
    ------
    InputError
        If an argument is invalid; `place` names the parameter.
    """
    known = None if knowledge is None else choice(Knowledge, knowledge, "knowledge")
    deadline = None if deadline_ms is None else float(real(deadline_ms, "deadline_ms", above=True))
    common = Run(objective=MISSION, deadline_ms=deadline, machine=machine or this_machine())
    problems = [(mission, replace(common, knowledge=str(known or mission.knowledge))) for mission in missions]
    packages = {name: versions(name, ENTRY_POINT_GROUP, POLICIES) for name, _ in policies.values()}
    numbers = [checked_seed(seed, "seeds") for seed in seeds]
    return plan(store, problems, policies, numbers, packages)


def policy_rows(comparison: Comparison, endings: Endings) -> list[PolicyRow]:
    """Return a row per mission and policy, as `compare_policies` does, from the runs that have ended.

    If a run of a policy has no result, its row has the reason instead.
    """
    return [
        _row(of_type(mission, Mission, "missions"), label, endings[label][number], comparison.seeds, number + 1)
        for number, mission in enumerate(comparison.instances)
        for label in comparison.methods
        if any(endings[label][number])
    ]


def _row(
    mission: Mission, policy: str, endings: Sequence[Ending | None], seeds: Sequence[int], number: int
) -> PolicyRow:
    reason = unsolved(endings, seeds)
    results = [] if reason else [result_of(ending) for ending in endings if ending is not None]
    return summarise_runs(mission, policy, results, reason, number)


def result_of(ending: Ending) -> MissionResult:
    """Return the result of a mission, with the measures that existed when the run was made."""
    measures = json.loads(ending.measures or "{}")
    return MissionResult(**{field.name: measures.get(field.name) for field in fields(MissionResult)})
