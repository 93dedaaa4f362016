"""A spatially representative sample of agents."""

import numpy as np

from alloc.problems import Instance
from alloc.problems.instance import FloatArray, IntArray

BITS = 16
"""Bits per coordinate of a code on the curve."""


def representatives(instance: Instance, count: int) -> tuple[IntArray, FloatArray]:
    """Return a sample of agents, and the total ability of the agents that each represents, including itself.

    Agents are divided into `count` blocks along a space-filling curve; one agent of each block, drawn at random,
    represents the ability of the whole block. Hence any region has about the same ability in the sample as in total.

    Parameters
    ----------
    instance : Instance
    count : int

    Returns
    -------
    chosen : ndarray of int, shape (min(count, n),)
    ability : ndarray, shape (min(count, n),)

    References
    ----------
    Morton (1966), A computer oriented geodetic data base and a new technique in file sequencing, IBM.
    """
    n, rng = instance.n, np.random.default_rng(0)
    if count >= n:
        return np.arange(n), instance.ability
    order = rng.permutation(n)
    order = order[np.argsort(_along_curve(instance)[order], kind="stable")]
    cut = np.linspace(0, n, count + 1).astype(np.intp)
    chosen = order[cut[:-1] + (rng.random(count) * np.diff(cut)).astype(np.intp)]
    return chosen, np.add.reduceat(instance.ability[order], cut[:-1])


def _along_curve(instance: Instance) -> IntArray:
    """Return the code of each agent on a Z-order curve, shape (n,); 0 if its position is unknown."""
    place = instance.reach.place
    known = ~np.isnan(place).any(axis=1)
    code = np.zeros(len(place), dtype=np.int64)
    if known.any():
        low, high = place[known].min(axis=0), place[known].max(axis=0)
        with np.errstate(over="ignore"):
            share = (place[known] - low) / np.where(high > low, high - low, 1.0)
        cell = (np.clip(np.nan_to_num(share), 0, 1) * (2**BITS - 1)).astype(np.int64)
        spread = np.zeros(len(cell), dtype=np.int64)
        for bit in range(BITS):
            for axis in range(3):
                spread |= (cell[:, axis] >> bit & 1) << (3 * bit + axis)
        code[known] = spread
    return code[instance.reach.origin]
