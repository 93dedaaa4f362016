"""Tuning of a policy's parameters by CMA-ES, on the missions on which `gappo` is evolved.

References
----------
Hansen and Ostermeier (2001), doi:10.1162/106365601750190398, as in DEAP (Fortin et al. 2012, JMLR 13:2171-2175).
"""

import dataclasses
import io
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from deap import base, cma
from numpy.typing import NDArray

from alloc.allocators.learned.missions.training.curriculum import PackedMission
from alloc.allocators.learned.missions.training.evolution import restore, state_of
from alloc.allocators.learned.missions.training.trainer import MissionTrainingParameters
from alloc.allocators.learned.missions.training.validation import cost_of, figures
from alloc.allocators.online.compiled.policies import final_state
from alloc.allocators.online.compiled.run import rank_of
from alloc.allocators.online.registry import load_policy
from alloc.problems.errors import InputError
from alloc.problems.fields import FloatArray
from alloc.problems.formats import write_bytes_atomically
from alloc.problems.formats.files import named

STEP = 0.5
"""Initial standard deviation of the logarithm of a parameter."""

FIRST = {
    "greedy": {"stay": 1.25, "memory": 1.5, "missed": 0.05, "crowding": 0.05, "flight": 0.05, "age": 0.05},
    "hedonic": {"stay": 1.5, "memory": 2.0, "missed": 0.05, "crowding": 0.5, "flight": 0.05, "age": 0.05},
    "auction": {"memory": 1.0, "stay": 3.0, "seats": 1.0, "flight": 1.0, "age": 0.05},
}
"""Initial parameters of each policy."""


VALIDATED_EVERY = 5
"""Number of generations between two validations."""


class _Fitness(base.Fitness):  # type: ignore[misc]
    weights = (-1.0,)


class _Candidate(list[float]):
    """Logarithms of parameters as an individual of DEAP."""

    def __init__(self, values: FloatArray, cost: float) -> None:
        super().__init__(values.tolist())
        self.fitness = _Fitness((cost,))


@dataclass(frozen=True)
class Tuned:
    """A generation of a tuning.

    Attributes
    ----------
    generation : int
    parameters : dict
        Parameters at the mean of the search distribution.
    cost : float or None
        Cost on the validation missions, as in `validate`; None for generations without a validation.
    missions : int
        Number of training missions run so far.
    """

    generation: int
    parameters: dict[str, float]
    cost: float | None
    missions: int


def tune(
    policy: str,
    generations: int,
    seed: int = 0,
    state: Path | None = None,
    setting: MissionTrainingParameters | None = None,
) -> Iterator[Tuned]:
    """Tune the parameters of a policy; yield every generation, of which that with the lowest cost is best.

    Parameters
    ----------
    policy : {"greedy", "hedonic", "auction"}
    generations : int
        Number of generations; as many as `gappo` evolves scores in gives both the same budget.
    seed : int
        Seed of all random numbers.
    state : Path, optional
        File (.npz) with the state; an interrupted tuning of the same policy and seed resumes from it.
    setting : MissionTrainingParameters, optional
        Numbers of candidates, missions and validations; by default those of `gappo`.
    """
    if policy not in FIRST:
        raise InputError(f"{policy!r} cannot be tuned; choose one of {', '.join(FIRST)}", "policy")
    setting = setting or MissionTrainingParameters()
    fields = dataclasses.fields(load_policy(policy).parameters)
    names, lows = [field.name for field in fields], np.array([field.metadata["low"] for field in fields])
    first = np.log([FIRST[policy][name] for name in names])
    validation = setting.curriculum.validation(setting.validations)
    strategy = cma.Strategy(centroid=first, sigma=STEP, lambda_=setting.candidates)
    if state is not None and state.exists():
        with np.load(state) as archive:
            kept = dict(archive)
        if (str(kept["policy"]), int(kept["seed"])) != (policy, seed):
            raise InputError("belongs to another policy or seed; choose another file", source=named(state))
        restore(strategy, kept)
    for generation in range(strategy.update_count, generations):
        rng = np.random.default_rng((seed, generation))
        missions = setting.curriculum.draw(rng, setting.missions, generation / generations)
        steps = rng.standard_normal((setting.candidates, strategy.dim)) @ strategy.BD.T
        rows = strategy.centroid + strategy.sigma * steps
        costs = [_cost(policy, np.maximum(np.exp(row), lows), missions) for row in rows]
        strategy.update([_Candidate(row, cost) for row, cost in zip(rows, costs, strict=True)])
        mean = np.maximum(np.exp(strategy.centroid), lows)
        if state is not None:
            _write(state, {**state_of(strategy), "policy": np.array(policy), "seed": np.array(seed)})
        is_due = (generation + 1) % VALIDATED_EVERY == 0 or generation + 1 == generations
        found = _cost(policy, mean, validation) if is_due else None
        parameters = dict(zip(names, mean.tolist(), strict=True))
        yield Tuned(generation + 1, parameters, found, (generation + 1) * setting.candidates * setting.missions)


def _write(path: Path, arrays: Mapping[str, NDArray[np.generic]]) -> None:
    buffer = io.BytesIO()
    np.savez(buffer, allow_pickle=False, **arrays)
    write_bytes_atomically(path, buffer.getvalue())


def _cost(policy: str, parameters: FloatArray, missions: list[tuple[PackedMission, int]]) -> float:
    """Return the mean cost of a policy over missions."""
    rows = []
    for one, seed in missions:
        ranks = rank_of(tuple(f"a{number}" for number in range(1, len(one.arrays.agents) + 1)))
        rows.append(figures(final_state(one.arrays, policy, parameters, seed, ranks), one.ideal))
    return cost_of(rows)
