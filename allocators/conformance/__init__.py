"""Tests that every allocator passes; subclass `AllocatorConformance` in the tests of your own. Needs pytest."""

import pytest

pytest.register_assert_rewrite("alloc.allocators.conformance.suite")  # failed checks then show their values

from alloc.allocators.conformance.suite import AllocatorConformance  # noqa: E402

__all__ = ["AllocatorConformance"]
