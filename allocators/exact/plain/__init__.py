"""The model with a variable for each agent and task, given to a solver without stages of our own."""
