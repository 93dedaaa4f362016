"""Local search in compiled code: annealing over exchanges between two groups, each of which is solved exactly."""
