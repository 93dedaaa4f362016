"""Missions as files: alloc-mission/1."""
