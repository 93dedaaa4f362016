"""Re-planning with a plan in force: moves may have a price, and agents may be pinned to tasks."""
