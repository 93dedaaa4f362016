"""Groups of agents in radio contact, and the routes that they announce to each other."""
