"""Whether missions in compiled loops are those of the reference: small ones of all kinds, a policy each, all measures.

    python tests/benchmarks/missions_equal.py --missions 10000 --first 0

Measures agree if they differ by no more than 1e-9 of their value, as sums are rounded. Prints each mission that
differs, and how many were compared.
"""

import argparse
import dataclasses
import math
import random
import sys
from collections import Counter

from alloc.allocators import load_policy, simulate
from alloc.allocators.online.compiled.run import run_compiled
from alloc.problems import Mission, MissionParameters, random_mission
from alloc.problems.missions.radio import Burst, Pace, Radio

POLICIES = ("nearest", "greedy", "hedonic", "auction", "gappo")
FAMILIES = ("steady", "waves", "hot-spots", "failures", "recharging", "growth", "deadlines", "silence")
KEPT = ("joins", "appears", "deadline", "growth", "events", "horizon", "knowledge", "seed")
OF_TIME = ("decision", "runtime")
"""How fields begin that no two runs have in common."""


def drawn(seed: int) -> Mission:
    """Return a small mission of any family, with any radio."""
    rng = random.Random(seed)
    knowledge = rng.choice(["local"] * 9 + ["full"])
    family = FAMILIES[seed % len(FAMILIES)]
    mission = random_mission(MissionParameters(family, rng.randint(2, 6), rng.randint(2, 8), knowledge=knowledge), seed)
    burst = Burst(rng.uniform(0.1, 2), rng.uniform(0.1, 2), rng.uniform(0, 0.3), rng.uniform(0.5, 1))
    radio = Radio(
        radius=rng.choice([0.15, 0.3, 0.6, math.inf]),
        period=rng.choice([0.1, 0.25, 0.37]),
        loss=rng.choice([0.0, 0.2, 0.8]),
        delay=rng.choice([0.0, 0.0, 0.05, 0.31]),
        burst=rng.choice([None, None, burst]),
    )
    kept = {name: getattr(mission, name) for name in KEPT}
    pace = rng.choice([None, None, None, Pace(1, 2, 1)])
    return Mission(mission.instance, **kept, radio=radio, pace=pace, sensing=rng.choice([0.15, 0.3, 0.6, math.inf]))


def differences(seed: int, name: str) -> list[str]:
    """Return the measures in which a mission differs between both simulations."""
    mission, policy = drawn(seed), load_policy(name)
    expected, found = simulate(mission, policy, seed=seed).result, run_compiled(mission, policy, seed)
    different = []
    for field in dataclasses.fields(expected):
        one, other = getattr(expected, field.name), getattr(found, field.name)
        is_number = isinstance(one, float) and isinstance(other, float)
        is_same = math.isclose(one, other, rel_tol=1e-9, abs_tol=1e-9) if is_number else one == other
        if not is_same and not field.name.startswith(OF_TIME):
            different.append(f"{field.name}: {one} and {other}")
    return different


def main() -> None:
    """Compare missions, and say how many differ."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--missions", type=int, default=10_000)
    parser.add_argument("--first", type=int, default=0)
    given = parser.parse_args()
    compared: Counter[str] = Counter()
    for number, seed in enumerate(range(given.first, given.first + given.missions), 1):
        name = POLICIES[seed // len(FAMILIES) % len(POLICIES)]
        different = differences(seed, name)
        compared["different" if different else "equal"] += 1
        if different:
            print(f"mission {seed} under {name}: {'; '.join(different)}", flush=True)
        if number % 500 == 0 or number == given.missions:
            print(f"{number} missions: {compared['equal']} equal, {compared['different']} different", flush=True)
    sys.exit(1 if compared["different"] else 0)


if __name__ == "__main__":
    main()
