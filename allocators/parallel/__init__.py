"""Work on many processors or machines: engines in one process, in several, and on a Ray cluster."""
