"""A linear relaxation over classes of agents, rounded."""
