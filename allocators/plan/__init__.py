"""Plans as tables, files and maps: who does what, when, and how much battery is left."""
