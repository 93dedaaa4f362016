"""Missions in compiled loops, for training: the same as `alloc.problems.missions.simulation`, without a log."""
