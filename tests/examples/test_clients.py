"""Clients in other languages use `alloc serve`: node over lines, curl and jq over HTTP, ended by SIGTERM."""

import os
import shutil
import subprocess
import sys

import pytest

ALLOC = [sys.executable, "-m", "alloc"]


def ran(command, **settings):
    """Return what a client prints."""
    done = subprocess.run(command, capture_output=True, text=True, timeout=110, check=False, **settings)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.skipif(shutil.which("node") is None, reason="node is not installed")
def test_node_over_lines(checkout):
    """One request is answered with a plan, the other is cancelled, and the service ends with its input."""
    printed = ran(["node", str(checkout / "examples/clients/client.mjs")], env={**os.environ, "ALLOC": " ".join(ALLOC)})
    first, second = printed.splitlines()
    assert first.startswith("first ")
    assert '"cleo":"' in first
    assert second == "second cancelled: the run was cancelled"


@pytest.mark.skipif(not all(map(shutil.which, ("curl", "jq"))), reason="curl or jq is not installed")
@pytest.mark.slow
def test_clients_over_http(checkout, tmp_path):
    """A shell and, if installed, node get plans over HTTP; SIGTERM ends the service with exit code 0."""
    ran(
        [*ALLOC, "generate", "random", "--agents", "6", "--tasks", "3", "--seed", "1", "--output", "six.json"],
        cwd=tmp_path,
    )
    with subprocess.Popen([*ALLOC, "serve", "--http", "0"], stderr=subprocess.PIPE, text=True) as server:
        address = server.stderr.readline().split()[-1]
        shell = ["sh", str(checkout / "examples/clients/client.sh"), address, "six.json"]
        lines = ran([*shell, "greedy"], cwd=tmp_path).splitlines()
        failed = subprocess.run([*shell, "gredy"], cwd=tmp_path, capture_output=True, text=True, check=False)
        node = shutil.which("node") and ran(["node", str(checkout / "examples/clients/client.mjs"), address])
        server.terminate()
        assert server.wait(30) == 0
    assert " h, " in lines[0]
    assert len(lines) == 7
    assert (failed.returncode, "did you mean 'greedy'" in failed.stderr) == (1, True)
    assert node is None or node.startswith("first ")
