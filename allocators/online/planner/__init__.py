"""A planner to embed in other programs: it takes events and reports of agents, and returns orders in time."""
