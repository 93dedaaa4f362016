"""Temporary torch settings for the current thread, independent of those of its caller and of other threads."""

import ctypes
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from functools import cache


@contextmanager
def torch_threads(threads: int) -> Iterator[None]:
    """Set the number of threads that torch uses when called from this thread; restored after the block.

    `torch.set_num_threads` applies to the whole process, so that two concurrent runs that each restore the previous
    number could leave behind that of the other. The underlying libraries keep a number per thread, which is set here;
    builds of torch without these libraries are left unchanged.
    """
    import torch  # imported late, as it takes seconds and options are checked before

    before = torch.get_num_threads()  # the first call in a thread sets the number
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
    """Return torch's library, through which the libraries that it links to are accessible."""
    import torch

    return ctypes.CDLL(torch._C.__file__)


@contextmanager
def plain_torch() -> Iterator[None]:
    """Enable gradients, and disable inference mode, autocast and default devices other than the CPU, in the block.

    The caller may be within `torch.no_grad`, `torch.inference_mode`, `torch.autocast` or another default device. All of
    these are per thread, so other threads are not affected.
    """
    import torch

    with ExitStack() as stack:
        stack.enter_context(torch.inference_mode(False))
        stack.enter_context(torch.enable_grad())
        for kind in ("cpu", "cuda"):
            if torch.is_autocast_enabled(kind):
                stack.enter_context(torch.autocast(kind, enabled=False))
        # only if needed, as it slows down every call; up to torch 2.7, `get_default_device` ignores contexts
        if torch.empty(0).device.type != "cpu":
            stack.enter_context(torch.device("cpu"))
        yield
