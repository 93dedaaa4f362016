"""Schedules of hyperparameters over the progress of a training, 0 to 1."""

import torch


def linear(first: float, final_fraction: float, progress: float) -> float:
    """Return the linear interpolation between `first` and `final_fraction` of it."""
    return first * (1 - (1 - final_fraction) * progress)


def exponential(first: float, last: float, progress: float) -> float:
    """Return the geometric interpolation between `first` and `last`; always 0 if `first` is 0."""
    return first * (last / first) ** progress if first > 0 else first


def set_learning_rate(optimiser: torch.optim.Optimizer, rate: float) -> None:
    """Set the learning rate of all parameter groups."""
    for group in optimiser.param_groups:
        group["lr"] = rate
