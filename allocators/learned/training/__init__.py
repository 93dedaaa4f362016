"""Training of policies: curriculum, validation, the training run, and tuning.

`train` does all of it as a function; it is imported on first use, as it needs torch.
"""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from alloc.allocators.learned.training.run import train

__all__ = ["train"]


def __getattr__(name: str) -> object:
    if name == "train":
        from alloc.allocators.learned.training.run import train

        return train
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
