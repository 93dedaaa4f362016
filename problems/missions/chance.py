"""Counter-based random numbers: they depend only on a key, so all policies face the same ones in whatever order."""

_MASK = (1 << 64) - 1
_GOLDEN = 0x9E3779B97F4A7C15

LOSS, BURST, PACE, EXPLORING = 1, 2, 3, 4
"""First part of a key: the purpose of the number."""


def uniform(*key: int) -> float:
    """Return a pseudo-random number in [0, 1) that is a function of the key.

    Parameters
    ----------
    *key : int
        From -2^63 to 2^64 - 1.

    References
    ----------
    Steele, Lea and Flood (2014), doi:10.1145/2714064.2660195: the mixer of SplitMix64.
    """
    state = _GOLDEN
    for part in key:
        state = _mixed((state ^ (part & _MASK)) + _GOLDEN & _MASK)
    return (state >> 11) * 2.0**-53


def _mixed(value: int) -> int:
    value = (value ^ (value >> 30)) * 0xBF58476D1CE4E5B9 & _MASK
    value = (value ^ (value >> 27)) * 0x94D049BB133111EB & _MASK
    return value ^ (value >> 31)
