"""Tunes the parameters of a policy with the budget that `gappo` is evolved with; one line of JSON a generation.

    python tests/benchmarks/missions_tuning.py hedonic --seed 1 --state hedonic.npz

The parameters of the generation with the lowest cost, on missions of validation, are the defaults of the policy. With
`--state` an interrupted tuning goes on.
"""

import argparse
import dataclasses
import json
from pathlib import Path

from alloc.allocators.learned.missions.training.trainer import MissionTrainingParameters
from alloc.allocators.online.compiled.tuning import FIRST, tune

parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("policy", choices=list(FIRST))
parser.add_argument("--generations", type=int, default=MissionTrainingParameters.evolved)
parser.add_argument("--seed", type=int, default=1)
parser.add_argument("--state", type=Path)
given = parser.parse_args()
for one in tune(given.policy, given.generations, given.seed, given.state):
    print(json.dumps(dataclasses.asdict(one)), flush=True)
