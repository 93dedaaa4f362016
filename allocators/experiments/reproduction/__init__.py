"""The paper's experiments, made anew: learning from nothing, figures 2 to 6, and what becomes of its claims."""
