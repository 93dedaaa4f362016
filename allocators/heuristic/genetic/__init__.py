"""A genetic algorithm over assignments, on DEAP."""
