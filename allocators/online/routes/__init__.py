"""Plans that look ahead: each agent has a sequence of tasks, and coalitions meet at tasks."""
