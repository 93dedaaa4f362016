"""Files of the learned methods: policies and checkpoints."""
