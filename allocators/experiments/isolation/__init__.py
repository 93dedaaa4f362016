"""Runs in processes of their own, which can crash, hang or eat memory without harm to anything else."""
