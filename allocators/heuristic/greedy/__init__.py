"""Greedy list schedules."""
