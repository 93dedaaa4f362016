"""Runs for other programs: awaited, by lines of JSON, and over HTTP."""
