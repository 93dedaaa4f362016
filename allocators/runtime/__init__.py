"""What compiled code needs: compilation, random numbers, and ways to stop native solvers."""
