"""The network that all policies share, in torch and in compiled loops."""
