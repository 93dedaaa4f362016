"""`gappo` in missions: a network that scores what an agent knows, its compiled decisions, and its training."""
