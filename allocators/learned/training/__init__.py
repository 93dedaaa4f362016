"""Training of policies: curriculum, validation, trainer, tuning."""
