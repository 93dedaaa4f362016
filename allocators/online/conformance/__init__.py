"""Tests that every policy passes; subclass `PolicyConformance` in the tests of your own. Needs pytest."""

import pytest

pytest.register_assert_rewrite("alloc.allocators.online.conformance.suite")  # failed checks then show their values

from alloc.allocators.online.conformance.suite import PolicyConformance  # noqa: E402

__all__ = ["PolicyConformance"]
