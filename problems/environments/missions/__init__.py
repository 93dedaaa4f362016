"""Environments of missions, in which agents decide one at a time as they become free."""
