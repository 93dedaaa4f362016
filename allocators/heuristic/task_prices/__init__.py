"""Prices of tasks for large instances: a bound on the makespan, and plans that keep close to it."""
