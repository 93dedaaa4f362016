"""Missions for other people's learners: one decision after the other, as agents become free."""
