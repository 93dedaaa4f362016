"""Groups of agents that hear of each other: what was planned for whom."""
