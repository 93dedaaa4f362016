"""Policies with local knowledge on missions that no training saw: mission time against `greedy`, paired.

    python tests/benchmarks/missions_local.py --missions 100
    python tests/benchmarks/missions_local.py --missions 5 --policies greedy,hedonic,auction --rows 20/40

Half of the missions are of the family `steady`, half of `failures`; all policies meet the same. `gappo`, `ppo`,
`greedy` and `nearest` run in the compiled simulation, in twins that reach the same measures as the policies
(`--check`), the others in the reference. The table has the mean difference of mission times in per cent with its 95 %
interval, and means of energy, switches and messages per agent; missions that either policy leaves unfinished are
counted apart.
"""

import argparse
import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np
from missions_greedy import NAMES, led, look_around

from alloc.allocators import simulate
from alloc.allocators.learned.missions import situation as known
from alloc.allocators.learned.missions.network import compiled_weights
from alloc.allocators.learned.missions.network_arrays import MissionWeights
from alloc.allocators.learned.missions.play import Room, is_busy, play, room_for
from alloc.allocators.learned.missions.policy_file import SHIPPED, SHIPPED_PPO, load_network
from alloc.allocators.learned.missions.situation import fill
from alloc.allocators.missions.advance import advance
from alloc.allocators.missions.chance import first_key, keyed
from alloc.allocators.missions.layout import MESSAGES, OVER, TO_TASK, MissionArrays
from alloc.allocators.missions.orders import order
from alloc.allocators.missions.pack import begun, measure, pack
from alloc.allocators.online.policies.greedy import GreedyParameters
from alloc.allocators.runtime.compiled import compiled
from alloc.problems.fields import IntArray
from alloc.problems.missions.chance import EXPLORING
from alloc.problems.missions.families.draw import random_mission
from alloc.problems.missions.families.parameters import MissionParameters
from alloc.problems.missions.mission import Mission
from alloc.problems.missions.radio import Burst, Radio
from alloc.problems.missions.simulation.measures import MissionResult

FIRST_SEED = 3_000_000_000
"""Trainings draw seeds below 1e9, and validations begin there."""


@dataclass(frozen=True)
class Row:
    """A kind of missions."""

    agents: int = 20
    tasks: int = 40
    radius: float = 0.3
    radio: Radio | None = None
    loss: float = 0.2

    def mission(self, number: int) -> Mission:
        """Return one of the missions of this kind."""
        seed = FIRST_SEED + number
        family = ("steady", "failures")[number % 2]
        drawn = random_mission(
            MissionParameters(family, self.agents, self.tasks, radius=self.radius, sensing=self.radius, loss=self.loss),
            seed,
        )
        if self.radio is None:
            return drawn
        kept = ("joins", "appears", "deadline", "growth", "events", "horizon", "knowledge", "sensing", "seed")
        return Mission(drawn.instance, **{name: getattr(drawn, name) for name in kept}, radio=self.radio)


ROWS = {
    "20/40": Row(),
    "40/80": Row(40, 80),
    "10/40": Row(10, 40),
    "60/40": Row(60, 40),
    "radii 0.15": Row(radius=0.15),
    "loss 0": Row(loss=0.0),
    "loss 50 %": Row(loss=0.5),
    "loss 80 %": Row(loss=0.8),
    "bursts": Row(radio=Radio(radius=0.3, burst=Burst(good=1.0, bad=1.0))),
    "delay 0.5 h": Row(radio=Radio(radius=0.3, loss=0.2, delay=0.5)),
}


@compiled
def lead_nearest(state: MissionArrays, room: Room, seed: int, drawn: IntArray) -> None:
    """Let each agent go to the nearest task until it is over, as `Nearest` does."""
    head, key = state.head[0], keyed(first_key(EXPLORING), seed)
    while True:
        wanted = advance(state)
        if wanted == OVER:
            return
        if wanted == MESSAGES:
            continue
        for place in range(head.deciding):
            number = state.deciding[place]
            if state.agents[number].order == TO_TASK and is_busy(state, number):
                continue
            fill(state, number, room.situation)
            best, least = -1, np.inf
            for j in range(len(room.situation.can)):
                if room.situation.can[j] and room.situation.task[known.DISTANCE, j] < least:
                    best, least = j, room.situation.task[known.DISTANCE, j]
            if best >= 0:
                order(state, number, TO_TASK, best, (0.0, 0.0, 0.0))
            else:
                look_around(state, number, key, drawn)


@cache
def weights(policy: str) -> MissionWeights:
    """Return the weights of a shipped network."""
    return compiled_weights(load_network({"gappo": SHIPPED, "ppo": SHIPPED_PPO}[policy]))


def in_compiled_loops(mission: Mission, policy: str, seed: int) -> MissionResult:
    """Return the measures of a mission under a policy that has a compiled twin."""
    n, m = mission.instance.n, mission.instance.m
    if policy == "greedy":
        parameters = np.array([getattr(GreedyParameters(), name) for name in NAMES])
        state = led(pack(mission), parameters, seed)
    else:
        state = begun(pack(mission), seed)
        if policy == "nearest":
            lead_nearest(state, room_for(n, m), seed, np.zeros(n, np.intp))
        else:
            name, periods = with_periods(policy)
            play(state, room_for(n, m, periods), weights(name), seed)
    return measure(mission, state, policy, seed)


def in_reference(mission: Mission, policy: str, seed: int) -> MissionResult:
    """Return the measures of a mission under any policy."""
    name, periods = with_periods(policy)
    settings = {"periods": periods} if periods > 1 else {}
    return simulate(mission, name, seed=seed, **settings).result


def with_periods(policy: str) -> tuple[str, int]:
    """Return the name of a policy, and the radio periods for each message, as in ``gappo[periods=10]``."""
    name, _, periods = policy.rstrip("]").partition("[periods=")
    return name, int(periods or 1)


TWINS = ("gappo", "gappo[periods=10]", "ppo", "greedy", "nearest")


def run(row: Row, policy: str, missions: int) -> list[MissionResult]:
    """Return the measures of all missions of a kind."""
    way: Callable[[Mission, str, int], MissionResult] = in_compiled_loops if policy in TWINS else in_reference
    return [way(row.mission(number), policy, number) for number in range(missions)]


def difference(found: list[MissionResult], rivals: list[MissionResult]) -> str:
    """Return the mean difference of mission times in per cent, with its 95 % interval."""
    pairs = [(one.mission_time, other.mission_time) for one, other in zip(found, rivals, strict=True)]
    times = np.array([100 * (one / other - 1) for one, other in pairs if one is not None and other is not None])
    half = 1.96 * times.std(ddof=1) / math.sqrt(len(times)) if len(times) > 1 else math.nan
    left = f" ({len(pairs) - len(times)} unfinished)" if len(times) < len(pairs) else ""
    return f"{times.mean():+.1f} ± {half:.1f}{left}"


def line(name: str, policy: str, found: list[MissionResult], rivals: list[MissionResult]) -> str:
    """Return a line of the table."""
    agents = ROWS[name].agents
    time = np.mean([one.mission_time for one in found if one.mission_time is not None])
    columns = [np.mean([getattr(one, kind) / agents for one in found]) for kind in ("energy", "switches", "messages")]
    figures = " | ".join(f"{value:.1f}" for value in columns)
    return f"| {name} | {policy} | {time:.2f} | {difference(found, rivals)} | {figures} |"


def check() -> None:
    """Compare twins with policies."""
    for policy in TWINS:
        for number, name in enumerate(("20/40", "bursts", "delay 0.5 h")):
            mission = ROWS[name].mission(number)
            one, other = in_compiled_loops(mission, policy, number), in_reference(mission, policy, number)
            for kind in ("mission_time", "energy", "switches", "messages", "bytes"):
                assert math.isclose(getattr(one, kind), getattr(other, kind), rel_tol=1e-9), (policy, name, kind)
        print(policy, "is the same", flush=True)


def main() -> None:
    """Print the table, or check twins."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--missions", type=int, default=20)
    parser.add_argument("--policies", default="greedy,gappo,gappo[periods=10],ppo,nearest,hedonic,auction")
    parser.add_argument("--rows", default=",".join(ROWS))
    parser.add_argument("--rival", default="greedy")
    parser.add_argument("--check", action="store_true")
    given = parser.parse_args()
    if given.check:
        check()
        return
    print(f"| missions | policy | hours | time against {given.rival}, % | energy | switches | messages |")
    print("|---|---|--:|--:|--:|--:|--:|")
    for name in given.rows.split(","):
        rivals = run(ROWS[name], given.rival, given.missions)
        for policy in given.policies.split(","):
            found = rivals if policy == given.rival else run(ROWS[name], policy, given.missions)
            print(line(name, policy, found, rivals), flush=True)


if __name__ == "__main__":
    main()
