"""Tunes the utility of the policy `greedy`, on the missions and by the optimiser that `gappo` is evolved with.

    python tests/benchmarks/missions_greedy.py --check
    python tests/benchmarks/missions_greedy.py --generations 100 --seed 1

Each generation is one line: the parameters of the mean, and its cost on the missions of validation. `--check` compares
the compiled twin below with the policy, which it has to be equal to.
"""

import argparse
import math

import numpy as np
from deap import base, cma

from alloc.allocators import simulate
from alloc.allocators.learned.missions import situation as known
from alloc.allocators.learned.missions.options import done_with, expect
from alloc.allocators.learned.missions.play import Room, room_for
from alloc.allocators.learned.missions.situation import fill
from alloc.allocators.learned.missions.training.curriculum import MissionCurriculum, PackedMission
from alloc.allocators.learned.missions.training.validation import cost_of, figures
from alloc.allocators.missions.advance import advance
from alloc.allocators.missions.chance import first_key, fraction, keyed
from alloc.allocators.missions.layout import MESSAGES, OVER, STAY, TO_PLACE, TO_TASK, MissionArrays
from alloc.allocators.missions.motion import battery_of, can_fly, distance_between, place_of
from alloc.allocators.missions.orders import order
from alloc.allocators.missions.pack import begun, measure, pack
from alloc.allocators.online.policies.exploring import BATTERY_SHARE, TRIES
from alloc.allocators.online.policies.greedy import GreedyParameters, GreedyUtility
from alloc.allocators.runtime.compiled import compiled
from alloc.problems.fields import FloatArray, IntArray
from alloc.problems.missions.chance import EXPLORING
from alloc.problems.missions.families.draw import random_mission
from alloc.problems.missions.families.parameters import MissionParameters

NAMES = ("stay", "memory", "missed", "crowding", "flight")
FIRST = (1.25, 1.5, 0.05, 0.05, 0.05)
STEP = 0.5
"""Initial standard deviation of the logarithm of a parameter."""

LONGEST_MEMORY = 2.0
"""Hours; what `fill` forgets, the twin cannot remember."""

CANDIDATES, MISSIONS, VALIDATIONS = 16, 12, 24
"""As `alloc train gappo --missions` has them."""


class Fitness(base.Fitness):  # type: ignore[misc]
    """The cost of a candidate."""

    weights = (-1.0,)


class Candidate(list[float]):
    """Logarithms of parameters, as DEAP expects individuals."""


@compiled
def best_task(state: MissionArrays, number: int, room: Room, parameters: FloatArray) -> int:
    """Return the task of highest utility, -1 for none."""
    stay, memory, missed, crowding, flight = parameters
    situation, hour, row = room.situation, state.head[0].hour, state.agents[number].known
    fill(state, number, situation)
    for i in range(len(situation.counts)):
        situation.counts[i] &= hour - state.agent_hour[row, i] <= memory
    expect(situation)
    others, without = situation.coming.others, situation.coming.without
    own, task, best, highest = situation.own, situation.task, -1, 0.0
    for j in range(len(situation.can)):
        if not situation.can[j]:
            continue
        is_order = own[known.TARGET] == j
        is_there = is_order and own[known.IS_WORKING] > 0
        arrival = hour + (0.0 if is_there else task[known.DISTANCE, j] / own[known.SPEED])
        left, since = task[known.LEFT, j], task[known.KNOWN_AT, j]
        if others[j] == 0 and not is_there:
            left += task[known.GROWTH, j] * (arrival - since)
        with_me = done_with(situation, j, arrival, left)
        if with_me >= without[j]:
            continue
        hours = with_me - hour
        value = (1.0 if hours <= 0 else (with_me - arrival) / hours) * (task[known.PRIORITY, j] + 1e-6)
        value = value / (1 + crowding * others[j]) * math.exp(-flight * (arrival - hour))
        value *= missed if with_me > task[known.DEADLINE, j] else 1.0
        value *= stay if is_order else 1.0
        if value > highest:
            best, highest = j, value
    return best


@compiled
def look_around(state: MissionArrays, number: int, key: int, drawn: IntArray) -> None:
    """Send an agent that knows of nothing to do to a random place, as `Explorer` does."""
    head, agent = state.head[0], state.agents[number]
    nowhere = (0.0, 0.0, 0.0)
    if not head.is_local or head.sensing == np.inf:
        order(state, number, STAY, -1, nowhere)
        return
    if agent.flight != 0 and agent.order != TO_TASK:
        return
    here, battery = place_of(agent, head.hour), battery_of(agent, head.hour)
    at = np.zeros(3)
    for _ in range(TRIES):
        for axis in range(3):
            drawn[number] += 1
            chance = fraction(keyed(keyed(key, number + 1), drawn[number]))
            at[axis] = state.area[0, axis] + (state.area[1, axis] - state.area[0, axis]) * chance
        place = (at[0], at[1], at[2])
        energy = agent.energy_per_distance * distance_between(head.is_manhattan, here, place)
        is_cheap = battery == np.inf or energy <= BATTERY_SHARE * battery
        if is_cheap and can_fly(head.is_manhattan, agent, here, battery, place):
            order(state, number, TO_PLACE, -1, place)
            return
    order(state, number, STAY, -1, nowhere)


@compiled
def lead(state: MissionArrays, room: Room, parameters: FloatArray, seed: int, drawn: IntArray) -> None:
    """Let the utility lead all agents until their mission is over."""
    head, key = state.head[0], keyed(first_key(EXPLORING), seed)
    while True:
        wanted = advance(state)
        if wanted == OVER:
            return
        if wanted == MESSAGES:
            continue
        for place in range(head.deciding):
            number = state.deciding[place]
            task = best_task(state, number, room, parameters)
            if task >= 0:
                order(state, number, TO_TASK, task, (0.0, 0.0, 0.0))
            else:
                look_around(state, number, key, drawn)


def led(arrays: MissionArrays, parameters: FloatArray, seed: int) -> MissionArrays:
    """Return a mission that is over."""
    state = begun(arrays, seed)
    n, m = len(state.agents), len(state.tasks)
    lead(state, room_for(n, m), parameters, seed, np.zeros(n, np.intp))
    return state


def parameters_of(candidate: FloatArray) -> FloatArray:
    """Return parameters in the order of `NAMES`."""
    parameters = np.exp(candidate)
    parameters[1] = min(parameters[1], LONGEST_MEMORY)
    return parameters


def cost(candidate: FloatArray, missions: list[tuple[PackedMission, int]]) -> float:
    """Return the mean cost of missions, as `validate` counts it."""
    rows = [figures(led(one.arrays, parameters_of(candidate), seed), one.ideal) for one, seed in missions]
    return cost_of(*np.array(rows).mean(axis=0).tolist())


def check() -> None:
    """Compare the compiled twin with the policy."""
    settings = GreedyParameters(stay=1.4, memory=1.2, missed=0.1, crowding=0.3, flight=0.2)
    parameters = np.array([getattr(settings, name) for name in NAMES])
    for seed, family in enumerate(("steady", "failures", "recharging", "growth", "deadlines", "silence")):
        mission = random_mission(MissionParameters(family, 8, 12), seed)
        expected = simulate(mission, GreedyUtility(settings), seed=seed).result
        found = measure(mission, led(pack(mission), parameters, seed), "greedy", seed)
        for name in ("tasks_done", "energy", "switches", "messages", "bytes"):
            assert math.isclose(getattr(expected, name), getattr(found, name), rel_tol=1e-9), (family, name)
        print(family, "is the same", flush=True)


def tune(generations: int, seed: int) -> None:
    """Tune, and print each generation."""
    curriculum = MissionCurriculum()
    validation = curriculum.validation(VALIDATIONS)
    strategy = cma.Strategy(centroid=np.log(FIRST), sigma=STEP, lambda_=CANDIDATES)
    for generation in range(generations):
        rng = np.random.default_rng((seed, generation))
        missions = curriculum.draw(rng, MISSIONS, generation / generations)
        steps = rng.standard_normal((CANDIDATES, strategy.dim)) @ strategy.BD.T
        candidates = [Candidate(row) for row in strategy.centroid + strategy.sigma * steps]
        for candidate in candidates:
            candidate.fitness = Fitness((cost(np.array(candidate), missions),))
        strategy.update(candidates)
        mean = dict(zip(NAMES, np.round(parameters_of(strategy.centroid), 4).tolist(), strict=True))
        found = cost(strategy.centroid, validation)
        print(generation + 1, f"cost {found:.4f}", f"step {strategy.sigma:.3f}", mean, flush=True)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true")
    parser.add_argument("--generations", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    check() if given.check else tune(given.generations, given.seed)
