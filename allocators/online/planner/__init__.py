"""A planner inside another program: it is told what happens and what agents report, and answers orders in time."""
