"""Missions as pictures, films, and pages that play them."""
