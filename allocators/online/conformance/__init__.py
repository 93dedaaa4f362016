"""Conformance tests for policies: subclass `PolicyConformance` in the tests of your own policy. Needs pytest."""

import pytest

pytest.register_assert_rewrite("alloc.allocators.online.conformance.suite")  # makes failures show values

from alloc.allocators.online.conformance.suite import PolicyConformance  # noqa: E402

__all__ = ["PolicyConformance"]
