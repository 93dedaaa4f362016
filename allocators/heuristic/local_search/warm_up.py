"""Compiling before the clock runs."""

import numpy as np

from alloc.allocators.heuristic.local_search.annealing_state import Chain
from alloc.allocators.heuristic.local_search.plan import Weights
from alloc.problems import Allocation, Instance


def warm_up() -> None:
    """Call every compiled loop once, so that no run waits for the compiler."""
    instance = Instance(ability=[1.0, 2.0], workload=[1.0, 1.0], task_position=np.eye(2), start_task=[0, 1])
    chain = Chain(instance, 0, 1)
    chain.begin(Allocation([1, 0]), 1.0)
    chain.run(1, Weights(1.0, 0.0, 1.0, 1.0, 2.0, chain.sums), 1.0)
