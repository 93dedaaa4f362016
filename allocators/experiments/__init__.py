"""Experiments: several methods on several instances and seeds."""
