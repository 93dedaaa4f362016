"""Store of runs in an SQLite file: runs, their endings, and leases on runs in progress."""
