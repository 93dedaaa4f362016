"""The network of `gappo` in missions, compiled: the scores of one agent's options."""

import numpy as np

from alloc.allocators.learned.missions.network_arrays import HIDDEN, MissionWeights, Singles
from alloc.allocators.runtime.compiled import compiled_loosely_in_place

F = np.float32
SLOPE = F(0.1)


@compiled_loosely_in_place
def score(
    options: Singles, count: int, weights: MissionWeights, token: Singles, pooled: Singles, scores: Singles
) -> None:
    """Fill the scores of the first `count` options, as `MissionNetwork` gives them.

    Parameters
    ----------
    options : ndarray, shape (most, features)
        Columns behind the features are 0.
    count : int
    weights : MissionWeights
    token, pooled : ndarray, shape (most, width) and (2, width)
        Scratch.
    scores : ndarray, shape (most,)
    """
    inner, own = weights.inner, weights.own
    largest = F(-np.inf)
    for row in range(count):
        attention = F(0)
        for k in range(HIDDEN):
            value = weights.inner_bias[k]
            for feature in range(options.shape[1]):
                value += options[row, feature] * inner[k, feature]
            value = max(value, SLOPE * value)
            token[row, k] = value
            attention += value * weights.query[k]
        scores[row] = attention
        largest = max(largest, attention)
    add_context(token, count, largest, weights, pooled, scores)
    for row in range(count):
        score = F(0)
        for k in range(HIDDEN):
            value = pooled[1, k]
            for j in range(HIDDEN):
                value += token[row, j] * own[k, j]
            score += max(value, SLOPE * value) * weights.out[k]
        for feature in range(options.shape[1]):
            score += options[row, feature] * weights.skip[feature]
        scores[row] = score


@compiled_loosely_in_place
def add_context(
    token: Singles, count: int, largest: np.float32, weights: MissionWeights, pooled: Singles, attention: Singles
) -> None:
    """Fill the pooled token and what it adds to each option, the two rows of `pooled`."""
    pooled[0, :] = F(0)
    total = F(0)
    for row in range(count):
        share = np.exp(attention[row] - largest)
        total += share
        for k in range(HIDDEN):
            pooled[0, k] += share * token[row, k]
    for k in range(HIDDEN):
        value = F(0)
        for j in range(HIDDEN):
            value += pooled[0, j] * weights.context[k, j]
        pooled[1, k] = weights.own_bias[k] + value / total
