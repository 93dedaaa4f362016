"""Local search in compiled code: exact re-partition of two groups at a time, annealed."""
