"""File formats of missions and of their logs."""
