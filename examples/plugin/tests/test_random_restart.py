from alloc_random_restart import RandomRestart

from alloc.allocators import Allocator
from alloc.allocators.conformance import AllocatorConformance


class TestRandomRestart(AllocatorConformance):
    """Everything that `alloc` asks of an allocator."""

    def allocator(self) -> Allocator:
        return RandomRestart()
