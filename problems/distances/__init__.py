"""Distances from agents to tasks (1), and reachable tasks, C(i) of the paper."""
