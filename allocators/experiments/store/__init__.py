"""Runs in a file of SQLite: what ran, how it ended, and who works on what."""
