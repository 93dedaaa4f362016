"""The simulation of missions in compiled loops, for training: as `problems/missions/simulation`, but for what it refuses.

To be read in the order `arrays`, `chance`, `motion`, `knowledge`, `policies`, `loop`, `run`.
"""
