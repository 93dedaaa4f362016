"""The weights of the network of `gappo` in missions, as arrays for compiled code."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Singles = NDArray[np.float32]

HIDDEN = 16
"""Width of the network."""

WIDTH = 32
"""Number of columns for the features of an option, padded for vector instructions on eight or sixteen numbers."""


class MissionWeights(NamedTuple):
    """Weights of a `MissionNetwork`.

    Matrices are flattened, by input and then output, the transpose of torch's; `skip` is padded to `WIDTH` features.
    """

    inner: Singles
    inner_bias: Singles
    query: Singles
    own: Singles
    own_bias: Singles
    context: Singles
    out: Singles
    skip: Singles
