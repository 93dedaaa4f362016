"""Missions: allocation over time, while tasks appear, agents fail and knowledge may be local.

`mission` and `events` define missions, `simulation` runs them, `files`, `families` and `readers` provide them.
"""
