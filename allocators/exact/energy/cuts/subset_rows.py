"""Separation of cuts over sets of up to three classes (subset-row inequalities), compiled.

From a set of classes with an odd number c of agents, all groups together can take at most (c - 1) / 2 disjoint pairs of
agents: each group counts half its agents of the set, rounded down. A mixture of groups may violate this.

References
----------
Jepsen, Petersen, Spoorendonk and Pisinger (2008), Subset-row inequalities applied to the vehicle-routing problem with
time windows, doi:10.1287/opre.1070.0449.
"""

import numpy as np

from alloc.allocators.exact.knapsack import WholeArray
from alloc.allocators.runtime.compiled import compiled
from alloc.problems.instance import FloatArray

MAX_WORK = 100_000_000
"""Limit on the number of visits to groups, some tenths of a second, after which the search ends."""


@compiled
def violated_sets(
    use: WholeArray, part: FloatArray, count: WholeArray, least: float, most: int
) -> tuple[WholeArray, FloatArray]:
    """Return the sets of classes whose cuts are violated by at least `least`, shape (s, 3), and the violations.

    Parameters
    ----------
    use : ndarray of int, shape (k + 1, g)
        Agents of each class in each group of the mixture; the last row, of zeros, pads sets of fewer than three.
    part : ndarray, shape (g,)
        Weight of each group in the mixture.
    count : ndarray of int, shape (k + 1,)
    most : int
        Largest number of sets.
    """
    classes, found, work = len(use) - 1, 0, 0
    near = np.zeros((classes, classes + 1), dtype=np.bool_)
    for g in range(use.shape[1]):
        inside = np.flatnonzero(use[:, g])
        for one in inside:
            for other in inside:
                near[one, other] = one != other
    near[:, classes] = True
    sets, excess = np.empty((most, 3), dtype=np.int64), np.empty(most)
    for a in range(classes):
        others = np.flatnonzero(near[a])
        if work > MAX_WORK:
            break
        work += len(others) ** 2 * len(part) // 2
        for x in range(len(others)):
            b = others[x]
            for y in range(x, len(others)):
                c = others[y]
                if (b == c and b < classes) or (count[a] + count[b] + count[c]) % 2 == 0:
                    continue
                if (c == classes or near[b, c]) and a > b:  # found from its smallest class
                    continue
                halves = -1.0 * ((count[a] + count[b] + count[c]) // 2)
                for g in range(len(part)):
                    halves += part[g] * ((use[a, g] + use[b, g] + use[c, g]) // 2)
                if halves >= least and found < most:
                    sets[found, 0], sets[found, 1], sets[found, 2], excess[found] = a, b, c, halves
                    found += 1
    return sets[:found], excess[:found]
