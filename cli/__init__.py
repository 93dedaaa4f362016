"""Command line; no logic of its own."""
