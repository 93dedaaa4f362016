"""The problem as an integer programme for any solver, and the allocation in a solver's solution."""
