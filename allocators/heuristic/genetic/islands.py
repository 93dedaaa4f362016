"""Populations that evolve concurrently, each with its own epochs, and share the best allocation."""

import math
from collections import deque

import numpy as np

from alloc.allocators.contract.search import Search
from alloc.allocators.heuristic.genetic.encoding import Encoding
from alloc.allocators.heuristic.genetic.evolution import Evolution, GeneticParameters
from alloc.allocators.parallel.pool import thread_map
from alloc.problems import Allocation

TARGETS = (0.0, 0.5, 0.8, 0.95)
"""Target makespans of successive epochs, between the lower bound (0) and the best so far (1)."""

MAX_ISLANDS = 32
"""Maximum number of islands; further threads are not used."""

GENERATIONS = 10
"""Generations of each island between two exchanges of the best allocation."""


class Island:
    """A population that evolves towards one target makespan after another.

    Parameters
    ----------
    search : Search
        Its own search, which no other thread uses.
    encoding : Encoding
    parameters : GeneticParameters
    rng : Generator
    epoch : int
        Index of its first target.
    """

    def __init__(
        self,
        search: Search,
        encoding: Encoding,
        parameters: GeneticParameters,
        rng: np.random.Generator,
        epoch: int = 0,
    ) -> None:
        self.search, self.encoding, self.parameters, self.rng = search, encoding, parameters, rng
        self._epoch = epoch
        self._evolution: Evolution | None = None

    def run(self, generations: float = math.inf) -> int:
        """Evolve for up to `generations`, or until the search should stop; return the number done."""
        done = 0
        while done < generations and not self.search.should_stop():
            if self._evolution is None or self._evolution.is_over:
                target = _target_makespan(self.search, self._epoch)
                self._evolution = Evolution(self.search, self.encoding, self.parameters, self.rng, target)
                self._epoch += 1
            done += self._evolution.run(generations - done)
        return done

    def receive(self, allocation: Allocation) -> None:
        """Let an allocation compete with the population."""
        self.search.submit(allocation)
        if self._evolution is not None:
            self._evolution.receive(allocation)


def evolve_islands(search: Search, encoding: Encoding, parameters: GeneticParameters) -> None:
    """Evolve one island per thread, submit every improvement, and periodically send the best of all to each island.

    Cohoon, Hegde, Martin and Richards (1987), ICGA, 148-154.
    """
    found: list[deque[Allocation]] = [deque() for _ in range(min(search.threads, MAX_ISLANDS))]
    parts = [
        search.part(search.objective, search.tolerance, lambda new, kept=kept: kept.append(new.allocation))  # type: ignore[misc]
        for kept in found
    ]
    islands = [
        Island(part, encoding, parameters, np.random.default_rng([search.seed, number]), number)
        for number, part in enumerate(parts)
    ]
    with thread_map(len(islands)) as run_all:
        while not search.should_stop():
            left = math.inf if search.budget.iterations is None else search.budget.iterations - search.iteration
            shares = [min(GENERATIONS, (left + number) // len(islands)) for number in range(len(islands))]
            done = sum(run_all(lambda pair: pair[0].run(pair[1]), zip(islands, shares, strict=True)))
            search.iteration += done
            for kept in found:
                while kept:
                    search.submit(kept.popleft())
            if search.should_stop() or search.best is None or not done:
                return
            for island in islands:
                island.search.raise_bound(search.lower_bound)
                island.receive(search.best.allocation)


def _target_makespan(search: Search, epoch: int) -> float:
    """Return the target makespan of an epoch, in hours."""
    assert search.best is not None
    best = search.best.evaluation.served_makespan
    bound = min(search.lower_bound, best)
    return max(bound + TARGETS[epoch % len(TARGETS)] * (best - bound), np.finfo(float).tiny)
