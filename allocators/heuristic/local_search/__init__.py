"""Local search in compiled code: annealed exchanges between two groups, each solved exactly."""
