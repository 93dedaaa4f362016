"""Policies with local knowledge that are no networks, in compiled loops: to tune them, and to compare many missions."""
