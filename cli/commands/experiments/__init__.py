"""Commands for experiments: comparisons and their stores, reports, Pareto fronts and what-if analyses."""
