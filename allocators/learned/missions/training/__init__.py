"""Training of networks for missions: curriculum, PPO, validation, and a population that is bred."""
