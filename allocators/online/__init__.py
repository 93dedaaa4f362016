"""Policies for missions, behind one contract, and what runs them."""
