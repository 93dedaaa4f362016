"""The network of `ActorCritic` as compiled loops: one game at a time, without the price of a call per operation.

What is computed is what `network.py` and `problems.game.observation` say, in single precision; tests compare them.
"""

from collections.abc import Callable
from typing import NamedTuple, cast

import numpy as np
import torch
from numpy.typing import NDArray

from alloc.allocators.learned.network.actor_critic import ActorCritic
from alloc.allocators.runtime.compiled import compiled_loosely, inlined
from alloc.problems.game.board import LEAST
from alloc.problems.game.observation import AGENT_FEATURES, PAIR_FEATURES, SURPLUS, TASK_FEATURES

Real = NDArray[np.float32]
Small = NDArray[np.int32]
Flags = NDArray[np.bool_]

F = cast(Callable[[float], float], np.float32)  # to mypy, as to the loops, its numbers are floats like others


class Weights(NamedTuple):
    """Weights of a network, each with the inputs in rows; biases are the last row."""

    local1: Real
    local2: Real
    local3: Real
    embed: Real
    member: Real
    gather: Real
    attend: Real
    spread: Real
    slope: Real
    mix1: Real
    mix2: Real
    query: Real
    key: Real
    reserve1: Real
    reserve2: Real


def weights_of(network: ActorCritic) -> Weights:
    """Copy the weights that bids and the reserve depend on."""
    width, heads = network.size.task_width, network.size.heads
    none = np.zeros((0, 0), dtype=np.float32)

    def rows(layer: torch.nn.Module) -> Real:
        assert isinstance(layer, torch.nn.Linear)
        both = torch.cat([layer.weight.detach().T, layer.bias.detach()[None]]).cpu().numpy()
        return np.ascontiguousarray(both, dtype=np.float32)

    attention = network.size.attention
    slope = torch.nn.functional.softplus(network.nearness.detach()).cpu().numpy() if attention else np.zeros(heads)
    assert width % heads == 0
    return Weights(
        local1=rows(network.local[0]),
        local2=rows(network.local[2]),
        local3=rows(network.local[4]),
        embed=rows(network.embed),
        member=rows(network.member) if attention else none,
        gather=rows(network.gather) if attention else none,
        attend=rows(network.attend) if attention else none,
        spread=rows(network.spread) if attention else none,
        slope=slope.astype(np.float32),
        mix1=rows(network.mix[0]),
        mix2=rows(network.mix[2]),
        query=rows(network.query),
        key=rows(network.key),
        reserve1=rows(network.reserve[0]),
        reserve2=rows(network.reserve[2]),
    )


class View(NamedTuple):
    """One game: a row of each array of `Board`, the logarithms of the needs, and the price."""

    ability: Real
    need: Real
    log_need: Real
    supply: Real
    choice: Real
    apart: Real
    goal: Small
    legal: Flags
    distance: Real
    contribution: Real
    price: float


@inlined
def clip(x: float) -> float:
    """Features lie between -2 and 2."""
    return min(max(x, F(-2.0)), F(2.0))


@inlined
def sign(x: float) -> float:
    """Some between -1 and 1."""
    return min(max(x, F(-1.0)), F(1.0))


@inlined
def positive(x: float) -> float:
    """Return x where it is positive, else 0."""
    return max(x, F(0.0))


@compiled_loosely
def layer(x: Real, weights: Real, out: Real, rectify: bool) -> None:
    """Multiply by a matrix and add the bias, in place of what was in `out`."""
    inputs, width = weights.shape[0] - 1, weights.shape[1]
    for k in range(width):
        out[k] = weights[inputs, k]
    for j in range(inputs):
        factor = x[j]
        for k in range(width):
            out[k] += factor * weights[j, k]
    if rectify:
        for k in range(width):
            out[k] = positive(out[k])


@compiled_loosely
def score_agent(
    view: View,
    weights: Weights,
    lack: Real,
    agent: int,
    own: int,
    wanted: Flags,
    x: Real,
    one: Real,
    two: Real,
    out: Real,
) -> None:
    """Fill the local scores of an agent's bids for the wanted candidates, where it is at the candidate `own` now.

    Parameters
    ----------
    wanted : ndarray of bool, shape (c,)
    x, one, two : ndarray
        Room for features and hidden layers.
    out : ndarray, shape (c,)
    """
    goal, brings, flight = view.goal[agent], view.contribution[agent], view.distance[agent]
    first, second, third = weights.local1, weights.local2, weights.local3
    wide = len(one)
    ability, price = view.ability[agent], F(view.price)
    here = goal[own]
    own_lack, own_need, given = lack[here], max(view.need[here], F(LEAST)), brings[own]
    per_given, per_own_need = F(1) / max(given, F(LEAST)), F(1) / own_need
    x[2] = clip(own_lack * per_given * F(1 / 3))
    x[3] = sign((own_lack + given) * per_given)
    x[6] = clip(own_lack * per_own_need)
    x[7] = clip((own_lack + given) * per_own_need)
    x[11] = clip(price - F(1))
    x[13] = clip(view.log_need[here] - F(1.5))
    x[14] = clip(ability - F(1))
    x[18] = clip(view.supply[here])
    x[20] = clip(view.choice[agent])
    eased = positive(own_lack) - positive(own_lack + given)
    per_ability = F(1) / max(ability, F(LEAST))
    for k in range(len(wanted)):
        if not wanted[k]:
            continue
        there = goal[k]
        its_lack, need, brought = lack[there], max(view.need[there], F(LEAST)), brings[k]
        per_brought, per_need = F(1) / max(brought, F(LEAST)), F(1) / need
        distance = flight[k]
        further = distance - flight[own]
        rest = its_lack - brought
        gain = positive(its_lack) - positive(rest) + eased
        x[0] = clip(its_lack * per_brought * F(1 / 3))
        x[1] = sign(rest * per_brought)
        x[4] = clip(its_lack * per_need)
        x[5] = clip(rest * per_need)
        x[8] = clip(further)
        x[9] = clip(distance)
        x[10] = clip(price * further)
        x[12] = clip(view.log_need[there] - F(1.5))
        x[15] = clip(gain * per_brought)
        x[16] = clip(gain)
        x[17] = F(1) if its_lack < F(-SURPLUS / 2) else F(0)
        x[19] = clip(view.supply[there])
        x[21] = clip(brought * per_ability - F(1))
        for h in range(wide):
            one[h] = first[PAIR_FEATURES, h]
        for j in range(PAIR_FEATURES):
            factor = x[j]
            for h in range(wide):
                one[h] += factor * first[j, h]
        for h in range(wide):
            two[h] = second[wide, h]
        for j in range(wide):
            factor = one[j]
            if factor > 0:
                for h in range(wide):
                    two[h] += factor * second[j, h]
        total = third[wide, 0]
        for h in range(wide):
            total += positive(two[h]) * third[h, 0]
        out[k] = total


@compiled_loosely
def see_places(view: View, task: Small, group: Real, lack: Real, x: Real, weights: Weights, token: Real) -> None:
    """Embed what is known of each place (`observe_tasks`) into `token`, shape (places, width)."""
    places = len(lack)
    members = np.zeros(places, dtype=np.float32)
    for agent in range(len(task)):
        if view.ability[agent] > 0:
            members[task[agent]] += F(1)
    total = F(0)
    short = F(0)
    spare = F(0)
    ratio = F(np.inf)
    for j in range(places - 1):
        total += view.need[j]
        short += positive(lack[j])
        spare += positive(-lack[j])
        ratio = min(ratio, group[j] / max(view.need[j], F(LEAST)) if view.need[j] > 0 else F(1))
    total = max(total, F(1e-9))
    short, spare = short / total, spare / total
    for j in range(places):
        need = max(view.need[j], F(LEAST))
        x[0] = clip(lack[j] / need)
        x[1] = clip(lack[j] / F(3))
        x[2] = clip(F(5) * lack[j] / need)
        x[3] = clip(view.log_need[j] - F(1.5))
        x[4] = clip(group[j] / max(members[j], F(1)) - F(1))
        x[5] = clip(np.log1p(members[j]) - F(1.5))
        x[6] = F(1) if j == places - 1 else F(0)
        x[7] = clip(ratio)
        x[8] = clip(F(5) * short)
        x[9] = clip(F(5) * (spare - short))
        x[10] = clip(F(view.price) - F(1))
        x[11] = clip(view.supply[j])
        layer(x[:TASK_FEATURES], weights.embed, token[j], True)


@compiled_loosely
def hear_members(view: View, slot: Small, task: Small, lack: Real, x: Real, weights: Weights, token: Real) -> None:
    """Let each group attend to its members (`ActorCritic._members`), and add what they say to `token`."""
    places, width = token.shape
    heads = len(weights.slope)
    each = width // heads
    seen = np.empty(width + heads, dtype=np.float32)
    heard = np.zeros((places, width), dtype=np.float32)
    weight = np.zeros((places, heads), dtype=np.float32)
    price = F(view.price)
    for agent in range(len(task)):
        if not view.ability[agent] > 0:
            continue
        place, own = task[agent], slot[agent]
        own_lack, own_need = lack[place], max(view.need[place], F(LEAST))
        given, distance = view.contribution[agent, own], view.distance[agent, own]
        gives = max(given, F(LEAST))
        x[0] = clip(view.ability[agent] - F(1))
        x[1] = clip(own_lack / gives / F(3))
        x[2] = sign((own_lack + given) / gives)
        x[3] = clip(given / own_need)
        x[4] = clip(distance)
        x[5] = clip(price * distance)
        x[6] = clip(view.choice[agent])
        x[7] = clip(own_lack / own_need)
        layer(x[:AGENT_FEATURES], weights.member, seen, False)
        for h in range(heads):
            share = np.exp(F(8) * np.tanh(seen[h] / F(8)))
            weight[place, h] += share
            for k in range(h * each, (h + 1) * each):
                heard[place, k] += share * positive(seen[heads + k])
    said = np.empty(width, dtype=np.float32)
    for j in range(places):
        for k in range(width):
            heard[j, k] /= weight[j, k // each] + F(1e-6)
        layer(heard[j], weights.gather, said, False)
        for k in range(width):
            token[j, k] += said[k]


@compiled_loosely
def hear_neighbours(view: View, weights: Weights, token: Real) -> None:
    """Let places attend to each other (`ActorCritic._neighbours`), and add what they say to `token`."""
    places, width = token.shape
    heads = len(weights.slope)
    each = width // heads
    asked = np.empty((places, 3 * width), dtype=np.float32)
    for j in range(places):
        layer(token[j], weights.attend, asked[j], False)
    key = np.empty((width, places), dtype=np.float32)
    for j in range(places):
        for k in range(width):
            key[k, j] = asked[j, width + k]
    likeness = np.empty(places, dtype=np.float32)
    heard = np.empty(width, dtype=np.float32)
    said = np.empty(width, dtype=np.float32)
    scale = F(1) / np.sqrt(F(each))
    for j in range(places):
        heard[:] = 0
        for h in range(heads):
            for i in range(places):
                likeness[i] = -weights.slope[h] * view.apart[j, i]
            for k in range(h * each, (h + 1) * each):
                factor = asked[j, k] * scale
                for i in range(places):
                    likeness[i] += factor * key[k, i]
            largest = likeness.max()
            total = F(0)
            for i in range(places):
                likeness[i] = np.exp(likeness[i] - largest)
                total += likeness[i]
            for i in range(places):
                share = likeness[i] / total
                for k in range(h * each, (h + 1) * each):
                    heard[k] += share * asked[i, 2 * width + k]
        layer(heard, weights.spread, said, False)
        for k in range(width):
            token[j, k] += said[k]


@compiled_loosely
def know_places(
    view: View, slot: Small, task: Small, group: Real, lack: Real, x: Real, weights: Weights, token: Real, key: Real
) -> float:
    """Fill `token` (`ActorCritic.places`), shape (places, width), and its keys in columns; return the reserve."""
    places, width = token.shape
    see_places(view, task, group, lack, x, weights, token)
    if len(weights.member):
        hear_members(view, slot, task, lack, x, weights, token)
        hear_neighbours(view, weights, token)
    wide = np.empty(2 * width, dtype=np.float32)
    said = np.empty(width, dtype=np.float32)
    pooled = np.zeros(2 * width, dtype=np.float32)
    pooled[width:] = -np.inf
    for j in range(places):
        layer(token[j], weights.mix1, wide, True)
        layer(wide, weights.mix2, said, False)
        mean = F(0)
        for k in range(width):
            token[j, k] += said[k]
            mean += token[j, k]
        mean /= F(width)
        spread = F(0)
        for k in range(width):
            spread += (token[j, k] - mean) ** 2
        factor = F(1) / np.sqrt(spread / F(width) + F(1e-5))
        for k in range(width):
            token[j, k] = (token[j, k] - mean) * factor
            pooled[k] += token[j, k] / F(places)
            pooled[width + k] = max(pooled[width + k], token[j, k])
        layer(token[j], weights.key, said, False)
        for k in range(width):
            key[k, j] = said[k]
    layer(pooled, weights.reserve1, said, True)
    layer(said, weights.reserve2, wide[:1], False)
    score: float = wide[0]
    return score
