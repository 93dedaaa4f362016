"""The contract of an allocator: what a method is told, what it answers, and within which budget."""
