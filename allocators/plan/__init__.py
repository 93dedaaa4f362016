"""A plan as tables, files and maps for people: who does what, when, and with how much battery left."""
