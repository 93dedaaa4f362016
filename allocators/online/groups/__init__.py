"""Groups of agents that hear of each other: what was planned for whom, and where each looks around."""
