"""Heuristic methods: good allocations in little time."""
