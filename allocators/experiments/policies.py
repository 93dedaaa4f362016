"""Comparison of policies on missions and seeds: one row per policy and mission."""

import threading
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial

from alloc.allocators.experiments.sweep import by_label, load_failure, mean, mean_and_worst, sweep
from alloc.allocators.online.contract import Policy
from alloc.allocators.online.registry import load_policy
from alloc.allocators.online.run import simulate_until
from alloc.allocators.runtime.interrupts import run_native
from alloc.problems import InputError, MissingPackageError, Mission, MissionResult
from alloc.problems.arguments import checked_seed, choice, event, listed, of_type, real
from alloc.problems.vocabulary import Knowledge


@dataclass(frozen=True, kw_only=True)
class PolicyRow:
    """Results of one policy on one mission, over all seeds.

    Attributes
    ----------
    mission, policy : str
    knowledge : str
        Knowledge of the agents; empty if there was no run.
    agents, tasks : int
    runs : int
        Number of runs; 0 after a refusal.
    statuses : str
        ``done``, ``unfinished``, or both, separated by ``/``.
    mission_time_mean, mission_time_worst : float or None
        None if a run did not do all tasks.
    mission_time_lower_bound : float or None
    tasks_done_share, priority_done_share : float or None
        Mean share of tasks done among those not cancelled, by number and by priority.
    completion_hours_mean : float or None
        Mean hours from appearance to completion; None if a run completed no task.
    energy_mean, distance_mean, switches_mean, messages_mean : float or None
    decision_ms_mean, decision_ms_worst : float or None
        Mean over runs of the mean decision time, and the maximum.
    decisions_late, orders_refused : int
        Totals over all runs.
    reason : str
        Why there are no results: a refusal, a missing package, or a failure.
    number : int
        Number of the mission, from 1, as names need not be unique.
    results : tuple of MissionResult
        One per seed; not in `to_dict`.
    """

    mission: str
    policy: str
    knowledge: str = ""
    agents: int
    tasks: int
    runs: int = 0
    statuses: str = ""
    mission_time_mean: float | None = None
    mission_time_worst: float | None = None
    mission_time_lower_bound: float | None = None
    tasks_done_share: float | None = None
    priority_done_share: float | None = None
    completion_hours_mean: float | None = None
    energy_mean: float | None = None
    distance_mean: float | None = None
    switches_mean: float | None = None
    messages_mean: float | None = None
    decision_ms_mean: float | None = None
    decision_ms_worst: float | None = None
    decisions_late: int = 0
    orders_refused: int = 0
    reason: str = ""
    number: int = 1
    results: tuple[MissionResult, ...] = ()

    def to_dict(self) -> dict[str, object]:
        """Return the fields by name, ready for JSON.

        Returns
        -------
        dict
        """
        return {name: value for name, value in asdict(self).items() if name != "results"}


Policies = Sequence[str | Policy] | Mapping[str, str | Policy]
"""Names of policies, or policies; in a mapping, by their label in the rows."""


def compare_policies(
    missions: Iterable[Mission],
    policies: Policies,
    seeds: Sequence[int] = (0,),
    *,
    knowledge: Knowledge | str | None = None,
    deadline_ms: float | None = None,
    stop: threading.Event | None = None,
) -> Iterator[PolicyRow]:
    """Simulate every mission with every policy and seed; all policies face the same events.

    Parameters
    ----------
    missions : iterable of Mission
    policies : sequence or dict
        Names, each of which is loaded once, and policies with their own parameters. The keys of a dict are the labels
        in the rows.
    seeds : sequence of int
    knowledge, deadline_ms
        As in `simulate`.
    stop : threading.Event, optional
        Ends the comparison when set; the run in progress is discarded.

    Returns
    -------
    iterator of PolicyRow
        Each row as soon as its runs are complete. If a policy refuses a mission, is not installed, or fails, its row
        has the reason; the traceback of a failure goes to the logger ``alloc``.

    Raises
    ------
    InputError
        If an argument is invalid; `place` names the parameter.
    """
    given = by_label(policies, Policy, lambda policy: policy.info.name, "policies")  # type: ignore[type-abstract]
    loaded = {label: _loaded(policy) for label, policy in given.items()}
    numbers = [checked_seed(seed, "seeds") for seed in listed(seeds, "seeds", "whole numbers")]
    problems = missions if isinstance(missions, Iterator) else listed(missions, "missions", "missions")
    stop = event(stop, "stop") or threading.Event()
    known = None if knowledge is None else choice(Knowledge, knowledge, "knowledge")
    deadline = None if deadline_ms is None else real(deadline_ms, "deadline_ms", above=True)

    checked = (of_type(mission, Mission, "missions") for mission in problems)

    def run(mission: Mission, policy: Policy, seed: int) -> MissionResult | None:
        ended = threading.Event()
        simulation = partial(simulate_until, ended.is_set, mission, policy, known, seed, deadline)
        found = run_native(simulation, stop.is_set, ended.set)  # in another thread, as a decision cannot be interrupted
        return None if found is None else found.result

    return (
        summarise_runs(one.problem, one.label, one.results, one.reason, one.number)
        for one in sweep(run, checked, loaded, numbers, stop)
    )


def _loaded(policy: str | Policy) -> Policy | Exception:
    """Load a policy once; a missing package or a failure is returned for the rows."""
    if isinstance(policy, Policy):
        return policy
    try:
        return load_policy(policy)
    except MissingPackageError as error:
        return error
    except InputError:
        raise
    except Exception as error:  # a faulty plugin must not affect other policies
        return load_failure(f"policy {policy!r}", error)


def summarise_runs(
    mission: Mission, policy: str, results: Sequence[MissionResult], reason: str = "", number: int = 1
) -> PolicyRow:
    """Return the row of one policy on one mission.

    Parameters
    ----------
    mission : Mission
    policy : str
    results : sequence of MissionResult
        One per seed.
    reason : str
        Why there are no results.
    number : int
        Number of the mission.

    Returns
    -------
    PolicyRow
    """
    size = (mission.instance.n, mission.instance.m)
    if not results:
        return PolicyRow(
            mission=mission.name, policy=policy, agents=size[0], tasks=size[1], reason=reason, number=number
        )
    time_mean, time_worst = mean_and_worst([result.mission_time for result in results])
    return PolicyRow(
        mission=mission.name,
        policy=policy,
        knowledge=results[0].knowledge,
        agents=size[0],
        tasks=size[1],
        runs=len(results),
        statuses="/".join(sorted({result.status for result in results})),
        mission_time_mean=time_mean,
        mission_time_worst=time_worst,
        mission_time_lower_bound=results[0].mission_time_lower_bound,
        tasks_done_share=mean([_share(result) for result in results]),
        priority_done_share=mean([result.priority_done_share for result in results]),
        completion_hours_mean=mean([result.completion_hours_mean for result in results]),
        energy_mean=mean([result.energy for result in results]),
        distance_mean=mean([result.distance for result in results]),
        switches_mean=mean([result.switches for result in results]),
        messages_mean=mean([result.messages for result in results]),
        decision_ms_mean=mean([result.decision_ms_mean for result in results]),
        decision_ms_worst=max((result.decision_ms_worst or 0.0 for result in results), default=None),
        decisions_late=sum(result.decisions_late for result in results),
        orders_refused=sum(result.orders_refused for result in results),
        number=number,
        results=tuple(results),
    )


def _share(result: MissionResult) -> float:
    wanted = result.tasks_done + result.tasks_missed + result.tasks_left
    return result.tasks_done / wanted if wanted else 1.0
