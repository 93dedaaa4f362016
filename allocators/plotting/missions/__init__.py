"""Missions as figures, animations and interactive pages."""
