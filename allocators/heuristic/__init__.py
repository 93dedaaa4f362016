"""Heuristic methods: good answers fast."""
