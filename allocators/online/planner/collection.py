"""Garbage is collected after a plan is made, not meanwhile: with many objects that alone takes a tenth of a second."""

import gc
import threading
from collections.abc import Iterator
from contextlib import contextmanager

_lock = threading.Lock()
_waiting = 0
_was_enabled = False


@contextmanager
def collected_later() -> Iterator[None]:
    """Hold back automatic collections until the last of those who ask for it at once is ready."""
    global _waiting, _was_enabled
    with _lock:
        if _waiting == 0:
            _was_enabled = gc.isenabled()
            gc.disable()
        _waiting += 1
    try:
        yield
    finally:
        with _lock:
            _waiting -= 1
            if _waiting == 0 and _was_enabled:
                gc.enable()
