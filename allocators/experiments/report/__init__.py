"""Reports on the runs of a comparison: tables and statistics, an HTML page, and exports of all runs."""
