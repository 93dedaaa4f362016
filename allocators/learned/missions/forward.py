"""The network of `gappo` in missions, compiled: the scores of one agent's options."""

import numpy as np

from alloc.allocators.learned.missions.feature_names import FEATURES
from alloc.allocators.learned.missions.network_arrays import HIDDEN, MissionWeights, Singles
from alloc.allocators.runtime.compiled import compiled_loosely

F = np.float32
SLOPE = F(0.1)


@compiled_loosely
def score(options: Singles, count: int, weights: MissionWeights, token: Singles, scores: Singles) -> None:
    """Fill the scores of the first `count` options, as `MissionNetwork` gives them.

    Parameters
    ----------
    options : ndarray, shape (most, features)
    count : int
    weights : MissionWeights
    token : ndarray, shape (most, width)
        Scratch.
    scores : ndarray, shape (most,)
    """
    pooled, both = np.zeros(HIDDEN, dtype=np.float32), np.empty(HIDDEN, dtype=np.float32)
    inner, own = weights.inner, weights.own
    largest = F(-np.inf)
    for row in range(count):
        for k in range(HIDDEN):
            both[k] = weights.inner_bias[k]
        for feature in range(FEATURES):
            value = options[row, feature]
            for k in range(HIDDEN):
                both[k] += value * inner[feature, k]
        attention = F(0)
        for k in range(HIDDEN):
            both[k] = max(both[k], SLOPE * both[k])
            token[row, k] = both[k]
            attention += both[k] * weights.query[k]
        scores[row] = attention
        largest = max(largest, attention)
    total = F(0)
    for row in range(count):
        share = np.exp(scores[row] - largest)
        total += share
        for k in range(HIDDEN):
            pooled[k] += share * token[row, k]
    add_context(pooled, float(total), weights)
    for row in range(count):
        for k in range(HIDDEN):
            both[k] = pooled[k]
        for j in range(HIDDEN):
            value = token[row, j]
            for k in range(HIDDEN):
                both[k] += value * own[j, k]
        value = F(0)
        for k in range(HIDDEN):
            value += max(both[k], SLOPE * both[k]) * weights.out[k]
        for feature in range(FEATURES):
            value += options[row, feature] * weights.skip[feature]
        scores[row] = value


@compiled_loosely
def add_context(pooled: Singles, total: float, weights: MissionWeights) -> None:
    """Replace the sum of tokens, shape (width,), by what the pooled token adds to each option."""
    result = weights.own_bias.copy()
    for j in range(HIDDEN):
        value = pooled[j] / total
        for k in range(HIDDEN):
            result[k] += value * weights.context[j, k]
    pooled[:] = result
