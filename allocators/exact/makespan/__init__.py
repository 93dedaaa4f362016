"""The least makespan: plans and bounds from bisection on T."""
