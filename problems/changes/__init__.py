"""The same problem after a change: agents and tasks that come, go or move."""
