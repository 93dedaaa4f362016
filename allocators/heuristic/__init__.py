"""Heuristic methods, which find good allocations quickly."""
