"""Runtime support: compilation, random numbers in compiled code, stop requests and native solvers."""
