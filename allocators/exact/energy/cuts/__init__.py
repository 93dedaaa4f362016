"""Cutting planes for the bound on the least energy."""
