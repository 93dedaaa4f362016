"""The network architecture of all policies, in torch and in compiled loops."""
