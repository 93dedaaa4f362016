"""Route plans: each agent has a sequence of tasks, and coalitions meet at tasks."""
