"""Deferral of garbage collection until a plan is made: with many objects, it may take a tenth of a second."""

import gc
import threading


class CollectedLater:
    """A reentrant context that disables automatic garbage collection while any thread is inside."""

    def __init__(self) -> None:
        self._lock, self._entered, self._was_enabled = threading.Lock(), 0, False

    def __enter__(self) -> None:
        with self._lock:
            if self._entered == 0:
                self._was_enabled = gc.isenabled()
                gc.disable()
            self._entered += 1

    def __exit__(self, *_: object) -> None:
        with self._lock:
            self._entered -= 1
            if self._entered == 0 and self._was_enabled:
                gc.enable()  # collection starts only at the next allocation


collected_later = CollectedLater()
