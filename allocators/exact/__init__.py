"""Exact methods: proven optima and bounds."""
