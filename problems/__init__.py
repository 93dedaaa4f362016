"""What is to be solved, and how good an answer is; knows nothing of allocators."""

import logging

from alloc.problems.allocation import Allocation
from alloc.problems.bounds import energy_lower_bound, lp_makespan_lower_bound, makespan_lower_bound
from alloc.problems.classes import AgentClasses, agent_classes, count_classes
from alloc.problems.distances.reach import Reach
from alloc.problems.errors import AllocError, InputError, MissingPackageError, RefusedError, TrainingError
from alloc.problems.evaluation import Evaluation, Objective, Violation, evaluate
from alloc.problems.formats import read_allocation, read_instance, write_allocation, write_instance
from alloc.problems.generate import paper, paper_like, random_instance
from alloc.problems.generate.covering import machine_covering
from alloc.problems.generate.family import Family
from alloc.problems.instance import IDLE, Instance
from alloc.problems.matching.serving import only_allowed, serve_all
from alloc.problems.matching.shortage import Shortage, find_shortage
from alloc.problems.matching.unservable import fewest_unserved, minimal_unservable_set

__all__ = [
    "IDLE",
    "AgentClasses",
    "AllocError",
    "Allocation",
    "Evaluation",
    "Family",
    "InputError",
    "Instance",
    "MissingPackageError",
    "Objective",
    "Reach",
    "RefusedError",
    "Shortage",
    "TrainingError",
    "Violation",
    "agent_classes",
    "count_classes",
    "energy_lower_bound",
    "evaluate",
    "fewest_unserved",
    "find_shortage",
    "lp_makespan_lower_bound",
    "machine_covering",
    "makespan_lower_bound",
    "minimal_unservable_set",
    "only_allowed",
    "paper",
    "paper_like",
    "random_instance",
    "read_allocation",
    "read_instance",
    "serve_all",
    "write_allocation",
    "write_instance",
]

logging.getLogger("alloc").addHandler(logging.NullHandler())  # silent, unless the program that uses us says otherwise
