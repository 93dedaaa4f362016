"""How torch computes in this thread for a while, whatever its caller and other threads have set."""

import ctypes
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from functools import cache


@contextmanager
def torch_threads(threads: int) -> Iterator[None]:
    """Let torch compute with so many threads where this thread calls it, and then with those that it had before.

    `torch.set_num_threads` sets that for the whole process, so that two runs at once, each of which puts back what it
    met, leave the number of the other behind. The libraries below keep a number per thread, which is set here; a
    build of torch without them is left as it is.
    """
    import torch  # here, so that options are checked before the seconds that it takes

    before = torch.get_num_threads()  # the first call in a thread sets it; later ones only ask
    library = _library()
    set_openmp = getattr(library, "omp_set_num_threads", None)
    set_mkl = getattr(library, "MKL_Set_Num_Threads_Local", None)
    if set_openmp is None:
        yield
        return
    mkl_before = 0
    set_openmp(threads)
    if set_mkl is not None:
        mkl_before = set_mkl(threads)
    try:
        yield
    finally:
        set_openmp(before)
        if set_mkl is not None:
            set_mkl(mkl_before)


@cache
def _library() -> ctypes.CDLL:
    """Return torch's library, through which those that it was linked with are reached."""
    import torch

    return ctypes.CDLL(torch._C.__file__)


@contextmanager
def plain_torch() -> Iterator[None]:
    """Compute with gradients, on the CPU unless another device is named, and in the precision of the tensors.

    A caller may be within `torch.no_grad`, `torch.inference_mode`, `torch.autocast` or another default device: all of
    these belong to a thread, so that nobody else sees them changed.
    """
    import torch

    with ExitStack() as stack:
        stack.enter_context(torch.inference_mode(False))
        stack.enter_context(torch.enable_grad())
        for kind in ("cpu", "cuda"):
            if torch.is_autocast_enabled(kind):
                stack.enter_context(torch.autocast(kind, enabled=False))
        # a context makes every call a little slower; up to torch 2.7, `get_default_device` knows none of the caller's
        if torch.empty(0).device.type != "cpu":
            stack.enter_context(torch.device("cpu"))
        yield
