"""Seeded instances: the paper's scenarios, a general family, and machine covering."""

from alloc.problems.generate.covering import machine_covering
from alloc.problems.generate.family import Distribution, Family, Sites, Spread, Starts
from alloc.problems.generate.instances import SCENARIOS, Scenario, paper, paper_like, random_instance

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
