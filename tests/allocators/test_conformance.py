"""Every method that ships with the package passes the suite that plugins subclass."""

import inspect
import sys
from typing import ClassVar

import pytest

from alloc.allocators.conformance import AllocatorConformance
from alloc.allocators.registry import BUILT_IN


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


class TestHedonicWithinHearing(AllocatorConformance):
    name = "hedonic"
    options: ClassVar = {"hearing": 0.5}
    iterations = 100


class TestAuction(AllocatorConformance):
    name = "auction"
    iterations = 200


class TestLpRound(AllocatorConformance):
    name = "lp-round"


class TestGappo(AllocatorConformance):
    name = "gappo"
    iterations = 4


class TestGappoLs(AllocatorConformance):
    name = "gappo-ls"


class TestPpo(AllocatorConformance):
    name = "ppo"
    iterations = 4


class TestA2c(AllocatorConformance):
    name = "a2c"
    iterations = 4


class TestDqn(AllocatorConformance):
    name = "dqn"
    iterations = 4


class TestDdpg(AllocatorConformance):
    name = "ddpg"
    iterations = 4


def test_no_method_is_left_out():
    """Each built-in method has its class above."""
    classes = [value for _, value in inspect.getmembers(sys.modules[__name__], inspect.isclass)]
    tested = {cls.name for cls in classes if issubclass(cls, AllocatorConformance)}
    assert tested - {""} == set(BUILT_IN)


def test_a_subclass_must_say_what_it_tests():
    """A subclass without a name and without an allocator fails, rather than testing nothing."""
    with pytest.raises(Exception, match="no method ''"):
        AllocatorConformance().allocator()
