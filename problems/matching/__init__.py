"""Which tasks can be served together: matchings of tasks with agents, and what to do where agents are too few."""
