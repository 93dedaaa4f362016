"""The plain model, with a variable for each agent and task, solved by a solver alone."""
