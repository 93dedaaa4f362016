"""The simulation of missions in compiled loops, for training: as `problems/missions/simulation`, with fewer features.

To be read in the order `arrays`, `motion`, `knowledge`, `policies`, `loop`, `run`. Machine code is cached by module:
after a change of `arrays`, remove the files ``__pycache__/*.nb*`` here, as the loops of the others do not see it.
"""
