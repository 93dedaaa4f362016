"""The weights of `ActorCritic` as arrays for the compiled loops."""

from typing import NamedTuple

import numpy as np
import torch

from alloc.allocators.learned.network.actor_critic import ActorCritic
from alloc.allocators.learned.network.compiled_layers import Floats


class Weights(NamedTuple):
    """Weights of the layers that bids and the reserve depend on.

    Each has shape (inputs + 1, outputs), with the biases in the last row; those of the attention are empty in a
    network without it.

    Attributes
    ----------
    local1, local2, local3 : ndarray
        Of the local part of the scores.
    embed, member, gather, attend, spread, mix1, mix2 : ndarray
        Of the places.
    slope : ndarray, shape (heads,)
        By which the attention falls with distance.
    query, key : ndarray
        Of the pointer.
    reserve1, reserve2 : ndarray
    """

    local1: Floats
    local2: Floats
    local3: Floats
    embed: Floats
    member: Floats
    gather: Floats
    attend: Floats
    spread: Floats
    slope: Floats
    mix1: Floats
    mix2: Floats
    query: Floats
    key: Floats
    reserve1: Floats
    reserve2: Floats


def weights_of(network: ActorCritic) -> Weights:
    """Copy the weights that bids and the reserve depend on."""
    width, heads = network.size.task_width, network.size.heads
    attention = network.size.attention
    slope = torch.nn.functional.softplus(network.nearness.detach()).cpu().numpy() if attention else np.zeros(heads)
    none = np.zeros((0, 0), dtype=np.float32)
    assert width % heads == 0
    return Weights(
        local1=_rows(network.local[0]),
        local2=_rows(network.local[2]),
        local3=_rows(network.local[4]),
        embed=_rows(network.embed),
        member=_rows(network.member) if attention else none,
        gather=_rows(network.gather) if attention else none,
        attend=_rows(network.attend) if attention else none,
        spread=_rows(network.spread) if attention else none,
        slope=slope.astype(np.float32),
        mix1=_rows(network.mix[0]),
        mix2=_rows(network.mix[2]),
        query=_rows(network.query),
        key=_rows(network.key),
        reserve1=_rows(network.reserve[0]),
        reserve2=_rows(network.reserve[2]),
    )


def _rows(layer: torch.nn.Module) -> Floats:
    assert isinstance(layer, torch.nn.Linear)
    both = torch.cat([layer.weight.detach().T, layer.bias.detach()[None]]).cpu().numpy()
    return np.ascontiguousarray(both, dtype=np.float32)
