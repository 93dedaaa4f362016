"""A search for plans of less energy by prices of work, for weights that depend on the task."""
