"""``alloc simulate`` and ``alloc replay``: missions, and what came of them."""
