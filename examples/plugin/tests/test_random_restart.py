from alloc_random_restart import RandomRestart

from alloc.allocators import Allocator
from alloc.allocators.conformance import AllocatorConformance


class TestRandomRestart(AllocatorConformance):
    """The conformance tests of `alloc` for allocators."""

    def allocator(self) -> Allocator:
        return RandomRestart()
