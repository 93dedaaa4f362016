"""The makespan stage: plans and lower bounds, by bisection on the makespan T."""
