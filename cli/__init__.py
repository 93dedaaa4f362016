"""Command line interface; the logic is in `alloc.problems` and `alloc.allocators`."""
