"""Pictures of results, for notebooks and the command line alike; needs matplotlib."""
