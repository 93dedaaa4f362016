"""Every method that ships with the package passes the suite that plugins subclass."""

import inspect
import sys
from typing import ClassVar

import pytest
import torch

from alloc.allocators import Budget, RefusedError, load
from alloc.allocators.conformance import AllocatorConformance
from alloc.allocators.conformance.cases import CASES
from alloc.allocators.contract.tolerance import MakespanTolerance
from alloc.allocators.refusal import refuse
from alloc.allocators.registry import BUILT_IN
from alloc.problems import InputError, Objective


class TestGreedy(AllocatorConformance):
    name = "greedy"


class TestLocalSearch(AllocatorConformance):
    name = "local-search"


class TestMilp(AllocatorConformance):
    name = "milp"


class TestCpsat(AllocatorConformance):
    name = "cpsat"


class TestGa(AllocatorConformance):
    name = "ga"


class TestHedonic(AllocatorConformance):
    name = "hedonic"
    iterations = 100


class TestHedonicWithinRadius(AllocatorConformance):
    name = "hedonic"
    options: ClassVar = {"communication_radius": 0.5}
    iterations = 100


class TestAuction(AllocatorConformance):
    name = "auction"
    iterations = 200


class TestLpRound(AllocatorConformance):
    name = "lp-round"


class TestGappo(AllocatorConformance):
    name = "gappo"
    iterations = 4


@pytest.mark.skipif(not torch.cuda.is_available(), reason="there is no GPU")
class TestGappoOnGpu(AllocatorConformance):
    name = "gappo"
    options: ClassVar = {"device": "cuda"}
    iterations = 4


class TestGappoLs(AllocatorConformance):
    name = "gappo-ls"


class TestPpo(AllocatorConformance):
    name = "ppo"
    iterations = 2  # as its kin below, it plays by the planner of `gappo`


@pytest.mark.slow
class TestA2c(AllocatorConformance):
    name = "a2c"
    iterations = 2


@pytest.mark.slow
class TestDqn(AllocatorConformance):
    name = "dqn"
    iterations = 2


@pytest.mark.slow
class TestDdpg(AllocatorConformance):
    name = "ddpg"
    iterations = 2


def test_no_method_is_left_out():
    """Each built-in method has a class above."""
    classes = [value for _, value in inspect.getmembers(sys.modules[__name__], inspect.isclass)]
    tested = {cls.name for cls in classes if issubclass(cls, AllocatorConformance)}
    assert tested - {""} == set(BUILT_IN)


def test_expected_refusals():
    """The suite skips what a method refuses: finite speeds for three methods, slack for two, and nothing else."""
    refused = set()
    for name in BUILT_IN:
        allocator = load(name)
        for instance in CASES.values():
            for what, slack in (("speeds" if instance.has_travel_time else "plain", 0.0), ("slack", 0.5)):
                try:
                    refuse(allocator, instance, Objective.MAKESPAN_ENERGY, Budget(), MakespanTolerance(slack))
                except RefusedError:
                    refused.add((name, what))
                    break
    speeds = {(name, "speeds") for name in ("ga", "hedonic", "auction")}
    assert refused == speeds | {("greedy", "slack"), ("ga", "slack")}


def test_subclass_without_method_fails():
    """A subclass without a name and without an allocator fails instead of testing nothing."""
    with pytest.raises(InputError, match="no method ''"):
        AllocatorConformance().allocator()
