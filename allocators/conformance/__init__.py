"""Tests that every allocator passes; subclass `AllocatorConformance` in the tests of your own. Needs pytest."""

import pytest

for _module in ("runner", "answers", "runs", "isolation"):
    pytest.register_assert_rewrite(f"alloc.allocators.conformance.{_module}")  # failed checks then show their values

from alloc.allocators.conformance.suite import AllocatorConformance  # noqa: E402

__all__ = ["AllocatorConformance"]
