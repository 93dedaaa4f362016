"""Comparisons that are kept: where their instances come from, and what is made of their runs."""
