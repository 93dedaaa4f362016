"""Schedules of hyperparameters over the progress of a training, 0 to 1."""

import torch


def linear(first: float, final_fraction: float, progress: float) -> float:
    """Return the value on the line from `first` to `final_fraction` of it."""
    return first * (1 - (1 - final_fraction) * progress)


def exponential(first: float, last: float, progress: float) -> float:
    """Return the value on the geometric path from `first` to `last`; 0 throughout where `first` is 0."""
    return first * (last / first) ** progress if first > 0 else first


def set_learning_rate(optimiser: torch.optim.Optimizer, rate: float) -> None:
    """Set the learning rate of all parameter groups."""
    for group in optimiser.param_groups:
        group["lr"] = rate
