"""Training of networks for missions: curriculum, PPO, validation and breeding."""
