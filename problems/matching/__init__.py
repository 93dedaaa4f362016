"""Bipartite matchings of tasks with agents, to decide which tasks can be served together if agents are scarce."""
