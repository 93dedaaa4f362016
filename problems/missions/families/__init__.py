"""Generators of random missions."""
