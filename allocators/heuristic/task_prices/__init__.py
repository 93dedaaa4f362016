"""Prices of tasks for large instances, which give a bound on the makespan and plans close to it."""
