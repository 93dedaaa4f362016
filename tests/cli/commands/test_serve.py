"""``alloc serve``: errors are one line that names the option."""

import socket
import subprocess
import sys
from pathlib import Path

import pytest


def test_occupied_port_is_one_line(alloc):
    """The line has the reason of the operating system, and the state of the process is restored."""
    before = sys.getswitchinterval()
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        ran = alloc("serve", "--http", str(port))
    place = f"127.0.0.1:{port}"
    line = f"alloc: --http: cannot listen on {place}: address already in use; name another host or port\n"
    assert (ran.code, ran.out, ran.err) == (2, "", line)
    assert sys.getswitchinterval() == before


@pytest.mark.parametrize(
    ("load", "begin"),
    [
        ("gredy", "--load: there is no method 'gredy' (did you mean 'greedy'?)"),
        ("ga[population=1]", "--load: population: must be a whole number >= 4, got 1"),
        ("gappo[policy=no.safetensors]", "no.safetensors: no such policy file"),
    ],
)
def test_methods_that_cannot_be_loaded_are_one_line(alloc, load, begin):
    """It names the option, and the parameter of the method or the file if that is invalid."""
    ran = alloc("serve", "--stdio", "--load", load)
    assert (ran.code, ran.out, ran.err.count("\n")) == (2, "", 1)
    assert ran.err.startswith(f"alloc: {begin}")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="a device that is always full")
def test_unwritable_answers_end_the_service():
    """On a full disk it ends with one line and exit code 2, and no traceback, though more requests come."""
    command = [sys.executable, "-m", "alloc", "serve", "--stdio"]
    with open("/dev/full", "w") as full:
        ran = subprocess.run(
            command, input='{"id": 1}\n{"id": 2}\n', stdout=full, stderr=subprocess.PIPE, text=True, timeout=60
        )
    line = "alloc: standard output: cannot be written: no space left on device\n"
    assert (ran.returncode, ran.stderr) == (2, line)
