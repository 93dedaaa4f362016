"""A report as one page that a browser opens from disk: what is drawn is prepared here, and drawn by the page itself."""
