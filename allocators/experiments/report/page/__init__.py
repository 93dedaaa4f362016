"""Report as a self-contained HTML page: data are prepared here and drawn by scripts in the page."""
