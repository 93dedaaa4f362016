"""A linear programme over classes of agents, rounded."""
