"""The contract of an allocator: what a method receives, what it returns, and its budget."""
