"""Missions from files of others: benchmarks, configurations of simulators, and records of what really happened."""
