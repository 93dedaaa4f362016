"""``alloc train`` and ``alloc tune``, which make the policies of learned methods."""
