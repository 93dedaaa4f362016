"""Runs of policies in the compiled simulation, with the same measures as the reference simulation."""

import dataclasses
import math

import numpy as np

from alloc.allocators.learned.missions.network import compiled_weights
from alloc.allocators.learned.missions.play import new_buffers, play
from alloc.allocators.learned.missions.situation import MEMORY
from alloc.allocators.missions.pack import begun, measure, pack
from alloc.allocators.online.compiled.policies import NAMES, final_state
from alloc.allocators.online.contract import Policy
from alloc.allocators.online.policies.gappo import NetworkPolicy
from alloc.allocators.online.policies.outlook import UtilityParameters
from alloc.problems.errors import InputError
from alloc.problems.fields import FloatArray, IntArray
from alloc.problems.missions.mission import Mission
from alloc.problems.missions.simulation.measures import MissionResult


def run_compiled(mission: Mission, policy: Policy, seed: int = 0) -> MissionResult:
    """Return the measures of a mission under a policy, equal to those of `simulate` except for decision times.

    Parameters
    ----------
    mission : Mission
    policy : Policy
        `nearest`, `greedy`, `hedonic`, `auction`, `gappo` or `ppo`, with its parameters.
    seed : int
        Seed of the run.

    Raises
    ------
    InputError
        If the policy has no compiled version.
    RefusedError
        If the mission is too large, or has distances that the compiled simulation does not support.
    """
    name = policy.info.name
    arrays = pack(mission, memory=memory_of(policy, mission))
    if isinstance(policy, NetworkPolicy):
        state = begun(arrays, seed)
        buffers = new_buffers(mission.instance.n, mission.instance.m, policy.parameters.periods)
        play(state, buffers, compiled_weights(policy.network), seed)
    elif name in NAMES:
        state = final_state(arrays, name, parameters_of(policy), seed, rank_of(mission.instance.agent_ids))
    else:
        raise InputError(f"policy {name!r} has no compiled version", "policy")
    return measure(mission, state, name, seed)


def memory_of(policy: Policy, mission: Mission) -> float:
    """Return for how many hours a policy uses reports of other agents."""
    if isinstance(policy, NetworkPolicy):
        return MEMORY * mission.radio.period
    if policy.parameters_type is None or not issubclass(policy.parameters_type, UtilityParameters):
        return math.inf
    return float(policy.parameters.memory)


def parameters_of(policy: Policy) -> FloatArray:
    """Return the parameters of a policy in the order of their fields."""
    return np.array(dataclasses.astuple(policy.parameters) if policy.parameters_type else (), float)


def rank_of(names: tuple[str, ...]) -> IntArray:
    """Return the rank of each name in alphabetical order."""
    return np.argsort(np.argsort(np.array(names))).astype(np.intp)
