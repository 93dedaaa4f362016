"""Reports: the figures of a generation, which form one line of the log."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from alloc.allocators.learned.training.member import MemberResult


@dataclass(frozen=True)
class Report:
    """Figures of a generation; the names are columns of the log and keys of checkpoints.

    Attributes
    ----------
    generation : int
        Number of the generation, from 1.
    decisions, evaluations : int
        Decisions of agents, and states evaluated by networks, so far and summed over all members.
    cost, unserved, time, distance, others_time : float
        Validation figures of the best member; see `Validation`.
    best_cost : float
        The lowest cost so far.
    fitness : float
        Fitness (12) of the fittest member.
    reward, entropy, divergence, learning_rate : float
        Training figures of the best member; see `TrainingStats`, whose `approx_kl` is the divergence.
    seconds : float
        Training time so far.
    decisions_per_second : float
        Decisions of agents per second in this generation.
    """

    generation: int
    decisions: int
    evaluations: int
    cost: float
    unserved: float
    time: float
    distance: float
    others_time: float
    best_cost: float
    fitness: float
    reward: float
    entropy: float
    divergence: float
    learning_rate: float
    seconds: float
    decisions_per_second: float


def best_generation(history: Sequence[Report]) -> int:
    """Return the generation with the lowest cost, from 1; 0 if there is none."""
    costs = [report.cost for report in history]
    return 1 + int(np.argmin(costs)) if costs else 0


def next_report(
    history: Sequence[Report], results: Sequence[MemberResult], best: int, fitness: float, seconds: float
) -> Report:
    """Return the report of the generation that follows `history`.

    Parameters
    ----------
    results : sequence of MemberResult
        Results of all members.
    best : int
        Index of the member with the lowest cost.
    fitness : float
        Fitness of the fittest member.
    seconds : float
        Duration of this generation.
    """
    last = history[-1] if history else None
    decisions = sum(one.stats.decisions for one in results)
    validation, stats = results[best].validation, results[best].stats
    return Report(
        generation=len(history) + 1,
        decisions=decisions + (last.decisions if last else 0),
        evaluations=sum(one.stats.evaluations for one in results) + (last.evaluations if last else 0),
        cost=validation.cost,
        unserved=validation.unserved,
        time=validation.time,
        distance=validation.distance,
        others_time=validation.others_time,
        best_cost=min(validation.cost, last.best_cost if last else np.inf),
        fitness=fitness,
        reward=stats.reward,
        entropy=stats.entropy,
        divergence=stats.approx_kl,
        learning_rate=stats.learning_rate,
        seconds=seconds + (last.seconds if last else 0.0),
        decisions_per_second=decisions / max(seconds, 1e-9),
    )
