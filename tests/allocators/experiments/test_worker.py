"""Workers of experiments: what is left of one whose process cannot be started."""

import os
import subprocess
from pathlib import Path

import pytest

from alloc.allocators.experiments.isolation.cores import Cores
from alloc.allocators.experiments.isolation.worker import Worker

DESCRIPTORS = Path("/proc/self/fd")


@pytest.mark.skipif(not DESCRIPTORS.exists(), reason="lists the open descriptors of a process on Linux")
def test_failed_process_start_leaks_no_descriptor(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pipe and sockets are closed where there are too many processes for another one."""

    def refuse(*arguments: object, **options: object) -> None:
        raise BlockingIOError("resource temporarily unavailable")

    monkeypatch.setattr(subprocess, "Popen", refuse)
    before = sorted(os.listdir(DESCRIPTORS))
    with pytest.raises(BlockingIOError):
        Worker(Cores(), threads=1)
    assert sorted(os.listdir(DESCRIPTORS)) == before
