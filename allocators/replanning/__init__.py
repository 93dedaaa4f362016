"""Re-planning: a plan is in force, moves have a price, and some agents keep their tasks."""
