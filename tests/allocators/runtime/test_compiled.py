"""Loops are compiled once for all callers, whatever constants and integers these call them with."""

import numba
import numpy as np
import pytest

from alloc.allocators.runtime import compiled as module
from alloc.allocators.runtime.compiled import compiled


def add(start, step):
    return start + step


def summed(added):
    """Return a compiled loop that calls `added` with a constant at first, with elements, and with a constant."""

    @numba.njit
    def total(steps):
        found = 0
        for step in steps:
            found = added(found, step)
        return added(found, 10)

    return total


def test_constants_and_small_integers_share_a_specialisation():
    """A variable, a constant and 32-bit integers share one compiled function, with the same sum."""
    added = module._compiled_once(numba.njit(add))
    total = summed(added)
    assert total(np.array([1, 2], dtype=np.int32)) == 13
    assert total(np.array([2**40, -1])) == 2**40 + 9
    assert [str(one) for one in added.signatures] == ["(int64, int64)"]


def test_decorated_loops_share_specialisations():
    """Loops with the common decorator share, also if their machine code comes from the cache."""
    added = compiled(add)
    assert "get_call_template" in vars(added)
    assert summed(added)(np.array([1, 2], dtype=np.int32)) == 13


class Changed:
    """A compiled function of a numba whose inner parts are not those of today."""

    def get_call_template(self, call):
        return call


class Fixed:
    """Likewise, with nothing that could be replaced."""

    __slots__ = ()

    def get_call_template(self, args, kws):
        return args, kws


@pytest.mark.parametrize("function", [Changed(), Fixed(), object()])
def test_unknown_numba_versions_are_not_patched(function):
    """If the patched internals of numba differ, a function is left unchanged."""
    assert module._compiled_once(function) is function
    assert "get_call_template" not in getattr(function, "__dict__", {})


def test_loops_without_sharing_give_the_same_results(monkeypatch):
    """Without the patch each caller has its own compiled loops, with the same sums."""
    monkeypatch.setattr(module, "CALL_TEMPLATE_PARAMETERS", ["of another numba"])
    added = module._compiled_once(numba.njit(add))
    total = summed(added)
    assert total(np.array([1, 2], dtype=np.int32)) == 13
    assert total(np.array([2**40, -1])) == 2**40 + 9
    assert len(added.signatures) > 1
