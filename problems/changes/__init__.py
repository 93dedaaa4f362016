"""Changes of instances: agents and tasks that are added, removed or moved."""
