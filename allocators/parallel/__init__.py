"""Parallel execution: engines that apply a function to many items in one process, in several, or on a Ray cluster."""
