"""Compiled versions of the policies with local knowledge, for tuning and for comparisons over many missions."""
