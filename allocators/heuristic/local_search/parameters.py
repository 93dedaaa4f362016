"""Parameters of local search."""

import math
from dataclasses import dataclass

from alloc.allocators.contract.parameters import CheckedParameters, bounded
from alloc.allocators.heuristic.local_search.annealing_state import AnnealingState
from alloc.allocators.heuristic.local_search.plan import Weights

FLIGHTS = 2.6
"""Factor on the mean flight of the current plan as a unit of noise, if that exceeds the mean flight to a candidate."""


@dataclass(frozen=True)
class LocalSearchParameters(CheckedParameters):
    """Parameters of local search, tuned on the paper's scenarios with seeds >= 1000, and on hard instances.

    Attributes
    ----------
    exchanges : int
        Number of exchanges per iteration; a thousand take about 5 ms.
    neighbours : int
        Number of candidate tasks per origin and per task.
    initial_noise, final_noise : float
        First and last noise on distances, relative to the mean distance to a candidate task.
    short_task_penalty, shortfall_penalty : float
        Penalty of each task with a shortfall, and of a missing ability equal to the mean ability, in mean distances.
    attempt_noise : tuple of float
        Initial noise of successive attempts at a target makespan, relative to the mean ability.
    attempt_final_noise : float
        Final noise of these attempts.
    attempt_iterations : int
        Number of iterations of the first attempt at a target makespan.
    attempt_growth : float
        Factor on the number of iterations after a failed attempt.
    makespan_share : float
        Largest share of the budget spent on the makespan if energy counts as well.
    first_cycle : int
        Number of iterations of the first annealing cycle if the budget is unlimited; each cycle is twice as long.
    few_exchanges, many_exchanges : float
        Exchanges per agent up to which annealing begins at `final_noise`, and above which it begins at `initial_noise`.
    """

    exchanges: int = bounded(1000, low=1)
    neighbours: int = bounded(10, low=1)
    initial_noise: float = bounded(0.12, low=0, above=True)
    final_noise: float = bounded(0.007, low=0, above=True)
    short_task_penalty: float = bounded(1.2, low=0)
    shortfall_penalty: float = bounded(5.0, low=0)
    attempt_noise: tuple[float, ...] = bounded((0.1, 0.01, 0.03, 0.001), low=0, above=True)
    attempt_final_noise: float = bounded(1e-6, low=0, above=True)
    attempt_iterations: int = bounded(4, low=1)
    attempt_growth: float = bounded(1.2, low=1)
    makespan_share: float = bounded(0.5, low=0, high=1)
    first_cycle: int = bounded(100, low=1)
    few_exchanges: float = bounded(10.0, low=0, above=True)
    many_exchanges: float = bounded(100.0, low=0, above=True)

    def weights(self, state: AnnealingState, noise: float, penalty_factor: float) -> Weights:
        """Return the weights of exchanges that reduce the cost.

        Parameters
        ----------
        state : AnnealingState
        noise : float
            Relative to the mean distance to a candidate task, or to `FLIGHTS` mean flights if those are longer.
        penalty_factor : float
            Factor on both penalties.
        """
        unit = penalty_factor * max(state.candidate_cost, state.cost / state.instance.n)
        shortfall = self.shortfall_penalty * unit / state.mean_ability
        noise *= max(state.candidate_cost, FLIGHTS * state.cost / state.instance.n)
        return state.weights(1.0, noise, self.short_task_penalty * unit, shortfall)

    def noise_reduction(self, exchanges: float) -> float:
        """Return the factor on `initial_noise` for a budget of `exchanges` per agent."""
        if self.many_exchanges <= self.few_exchanges:
            return 1.0 if exchanges >= self.many_exchanges else self.final_noise / self.initial_noise
        rise = math.log(max(exchanges, 1e-9) / self.few_exchanges) / math.log(self.many_exchanges / self.few_exchanges)
        factor: float = (self.final_noise / self.initial_noise) ** (1 - min(1.0, max(0.0, rise)))
        return factor
