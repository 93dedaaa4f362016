"""Garbage is collected after a plan is made, not meanwhile: with many objects that alone takes a tenth of a second."""

import gc
import threading


class CollectedLater:
    """Holds back automatic collections while it is entered, by however many threads at once."""

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
                gc.enable()  # a collection begins only with the next object that is made


collected_later = CollectedLater()
