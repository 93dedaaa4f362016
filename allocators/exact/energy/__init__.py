"""The least energy at a makespan: plans and bounds."""
