"""Rounding of a linear relaxation over classes of agents."""
