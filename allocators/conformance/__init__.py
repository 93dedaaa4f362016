"""Conformance tests for allocators: subclass `AllocatorConformance` to test your own. Needs pytest."""

import pytest

for _module in ("runner", "answers", "runs", "isolation"):
    pytest.register_assert_rewrite(f"alloc.allocators.conformance.{_module}")  # so that failed checks show values

from alloc.allocators.conformance.suite import AllocatorConformance  # noqa: E402

__all__ = ["AllocatorConformance"]
