"""A genetic algorithm over assignments, based on DEAP."""
