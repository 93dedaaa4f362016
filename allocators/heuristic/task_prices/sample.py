"""A sample of agents that stands for all, everywhere in about the same way."""

import numpy as np

from alloc.problems import Instance
from alloc.problems.instance import FloatArray, IntArray

BITS = 16
"""Bits of each coordinate in a place along the curve."""


def representatives(instance: Instance, count: int) -> tuple[IntArray, FloatArray]:
    """Return agents, and the ability of all that each stands for, itself included.

    Agents are cut into `count` blocks along a curve that keeps near places together; one agent of each block, drawn at
    random, has the ability of all of it. Hence any region has about as much ability in the sample as it has in all.

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
    """Return the place of each agent along a Z-order curve, shape (n,); 0 where its position is unknown."""
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
