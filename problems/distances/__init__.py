"""Distances and reach: how far agents fly to tasks (1), and which tasks they can take, C(i) of the paper."""
