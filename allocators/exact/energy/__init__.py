"""The energy stage: plans and lower bounds for the least energy at a makespan."""
