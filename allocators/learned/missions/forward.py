"""The compiled network of `gappo` in missions, which scores the options of an agent."""

import numpy as np

from alloc.allocators.learned.missions.feature_names import FEATURES
from alloc.allocators.learned.missions.network_arrays import HIDDEN, MissionWeights, Singles
from alloc.allocators.runtime.compiled import compiled_fast_math_in_place

F = np.float32
SLOPE = F(0.1)


@compiled_fast_math_in_place
def score(
    options: Singles, count: int, weights: MissionWeights, token: Singles, pooled: Singles, scores: Singles
) -> None:
    """Write the scores of the first `count` options, equal to those of `MissionNetwork`.

    Parameters
    ----------
    options : ndarray, shape (most, features)
        Columns after the features are 0.
    count : int
    weights : MissionWeights
    token, pooled : ndarray, shape (most, width) and (2, width)
        Scratch space.
    scores : ndarray, shape (most,)
    """
    largest = F(-np.inf)
    for row in range(count):
        option, hidden = options[row], token[row]
        for k in range(HIDDEN):
            value = weights.inner_bias[k]
            for feature in range(FEATURES):
                value += option[feature] * weights.inner[feature * HIDDEN + k]
            hidden[k] = max(value, SLOPE * value)
        attention = F(0)
        for k in range(len(hidden)):
            attention += hidden[k] * weights.query[k]
        scores[row] = attention
        largest = max(largest, attention)
    add_context(token, count, largest, weights, pooled, scores)
    context = pooled[1]
    for row in range(count):
        option, hidden, score = options[row], token[row], F(0)
        for k in range(HIDDEN):
            value = context[k]
            for j in range(HIDDEN):
                value += hidden[j] * weights.own[j * HIDDEN + k]
            score += max(value, SLOPE * value) * weights.out[k]
        for feature in range(len(option)):
            score += option[feature] * weights.skip[feature]
        scores[row] = score


@compiled_fast_math_in_place
def add_context(
    token: Singles, count: int, largest: np.float32, weights: MissionWeights, pooled: Singles, attention: Singles
) -> None:
    """Write the pooled token, and its contribution to each option, into the two rows of `pooled`."""
    mean, context, total = pooled[0], pooled[1], F(0)
    mean[:] = F(0)
    for row in range(count):
        share = np.exp(attention[row] - largest)
        total += share
        hidden = token[row]
        for k in range(HIDDEN):
            mean[k] += share * hidden[k]
    for k in range(HIDDEN):
        value = F(0)
        for j in range(HIDDEN):
            value += mean[j] * weights.context[j * HIDDEN + k]
        context[k] = weights.own_bias[k] + value / total
