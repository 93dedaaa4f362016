"""The network of `gappo` in missions, compiled: the scores of one agent's options."""

import numpy as np

from alloc.allocators.learned.missions.network_arrays import MissionWeights, Singles
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
    features, width = weights.inner.shape
    pooled, both = np.zeros(width, dtype=np.float32), np.empty(width, dtype=np.float32)
    largest = F(-np.inf)
    for row in range(count):
        for k in range(width):
            token[row, k] = weights.inner_bias[k]
        for feature in range(features):
            value = options[row, feature]
            for k in range(width):
                token[row, k] += value * weights.inner[feature, k]
        attention = F(0)
        for k in range(width):
            token[row, k] = max(token[row, k], SLOPE * token[row, k])
            attention += token[row, k] * weights.query[k]
        scores[row] = attention
        largest = max(largest, attention)
    total = F(0)
    for row in range(count):
        share = np.exp(scores[row] - largest)
        total += share
        for k in range(width):
            pooled[k] += share * token[row, k]
    add_context(pooled, total, weights)
    for row in range(count):
        for k in range(width):
            both[k] = pooled[k]
        for j in range(width):
            value = token[row, j]
            for k in range(width):
                both[k] += value * weights.own[j, k]
        value = F(0)
        for k in range(width):
            value += max(both[k], SLOPE * both[k]) * weights.out[k]
        for feature in range(features):
            value += options[row, feature] * weights.skip[feature]
        scores[row] = value


@compiled_loosely
def add_context(pooled: Singles, total: float, weights: MissionWeights) -> None:
    """Replace the sum of tokens, shape (width,), by what the pooled token adds to each option."""
    width = len(pooled)
    result = weights.own_bias.copy()
    for j in range(width):
        value = pooled[j] / total
        for k in range(width):
            result[k] += value * weights.context[j, k]
    pooled[:] = result
