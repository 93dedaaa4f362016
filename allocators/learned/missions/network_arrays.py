"""The weights of the network of `gappo` in missions, as arrays for compiled code."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Singles = NDArray[np.float32]

HIDDEN = 16
"""Width of the network."""


class MissionWeights(NamedTuple):
    """Weights of a `MissionNetwork` that score options; matrices by input, then output."""

    inner: Singles
    inner_bias: Singles
    query: Singles
    own: Singles
    own_bias: Singles
    context: Singles
    out: Singles
    skip: Singles
