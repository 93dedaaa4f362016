"""Integer programmes of instances for any solver, and allocations from solvers' solutions."""
