"""Files of learning: policies and checkpoints."""
