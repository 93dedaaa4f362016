"""Random instances: the paper's scenarios, a general family, and machine covering."""

from alloc.problems.generate.covering import machine_covering
from alloc.problems.generate.family import Family, Spread
from alloc.problems.generate.paper_scenarios import SCENARIOS, Scenario, paper, paper_like
from alloc.problems.generate.random_family import random_instance
from alloc.problems.vocabulary import Distribution, Sites, Starts

__all__ = [
    "SCENARIOS",
    "Distribution",
    "Family",
    "Scenario",
    "Sites",
    "Spread",
    "Starts",
    "machine_covering",
    "paper",
    "paper_like",
    "random_instance",
]
