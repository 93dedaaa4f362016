"""``alloc train`` and ``alloc tune``, for the policies of learned methods."""
