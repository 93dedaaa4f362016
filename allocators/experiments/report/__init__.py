"""What is made of the runs of a comparison: tables and statistics for people and papers, runs for programs."""
