"""The simulation of missions in compiled loops, for training: as `problems/missions/simulation`, with fewer features.

To be read in the order `arrays`, `motion`, `knowledge`, `policies`, `loop`, `run`.
"""
