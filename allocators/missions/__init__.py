"""Compiled simulation of missions, for training: equivalent to `alloc.problems.missions.simulation`, without a log."""
