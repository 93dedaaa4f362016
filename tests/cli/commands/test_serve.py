"""``alloc serve``: what cannot be served is one line, with the option that says so."""

import socket
import sys

import pytest


def test_a_port_that_is_taken_is_one_line(alloc):
    """The line has the reason that the operating system gives, and nothing stays changed in the process."""
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
    """It names the option, and the parameter of the method or the file where it is one of those that are wrong."""
    ran = alloc("serve", "--stdio", "--load", load)
    assert (ran.code, ran.out, ran.err.count("\n")) == (2, "", 1)
    assert ran.err.startswith(f"alloc: {begin}")
