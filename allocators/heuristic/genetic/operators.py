"""Selection, crossover and random draws of the genetic algorithm, each for many rows of genes at once.

All random numbers come from the generator that is passed in, and not from the global `random` that DEAP's own operators
use, so that runs in several threads do not affect each other.
"""

import numpy as np
from numpy.typing import NDArray

from alloc.allocators.heuristic.genetic.encoding import Genes
from alloc.problems.instance import FloatArray, IntArray


def tournament(size: int, rounds: int, rng: np.random.Generator, entrants: int = 3) -> IntArray:
    """Return the winners of `rounds` tournaments among `size` individuals that are sorted by fitness, best first.

    The winner is the least of the indices drawn (Goldberg and Deb 1991, doi:10.1016/B978-0-08-050684-5.50008-2).
    """
    winners: IntArray = rng.integers(size, size=(rounds, entrants)).min(axis=1)
    return winners


def cross_groups(one: Genes, other: Genes, share: FloatArray, rng: np.random.Generator) -> Genes:
    """Replace some groups of each row of `one` by those of the same row of `other`, and return the children.

    Tasks are drawn at random, each with probability `share` of its row. Their groups in the child are those of `other`;
    agents that were in them before go where `other` has them. All other agents keep their tasks. Every gene is that of
    a parent, so that no child has an agent on a task that it cannot reach.

    References
    ----------
    Falkenauer (1994), doi:10.1162/evco.1994.2.2.123: groups should be inherited instead of single genes. Unlike the
    bins there, tasks are distinguishable, so that no group has to be dissolved and refilled.
    """
    rows, width = len(one), int(max(one.max(), other.max())) + 1
    taken = (rng.random((rows, width)) < share[:, None]).ravel()
    cell = (np.arange(rows) * width)[:, None]
    return np.where(taken[one + cell] | taken[other + cell], other, one)


def draw_column(weight: FloatArray, rng: np.random.Generator, uniform: float) -> IntArray:
    """Draw a column of each row in proportion to its weight, or, with probability `uniform`, any column."""
    ignored = (rng.random(len(weight)) < uniform) | ~(weight.max(axis=1) > 0)
    return roulette(np.where(ignored[:, None], 1.0, weight), rng)


def roulette(weight: FloatArray, rng: np.random.Generator) -> IntArray:
    """Draw one column of each row in proportion to its weight; any column if all weights are 0."""
    largest = weight.max(axis=1, keepdims=True)
    total = np.cumsum(weight / np.where(largest > 0, largest, 1.0), axis=1)  # so that no sum overflows
    mark = rng.random((len(weight), 1)) * total[:, -1:]
    drawn: NDArray[np.intp] = (total <= mark).sum(axis=1).clip(max=weight.shape[1] - 1)
    return drawn
