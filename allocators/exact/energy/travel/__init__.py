"""A search for plans of less energy that prices the work of agents, for weights that depend on the task."""
