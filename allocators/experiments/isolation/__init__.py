"""Runs in separate processes, which can crash, hang or exhaust memory without affecting others."""
