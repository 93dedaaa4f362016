"""Seeded random missions of many kinds."""
