"""The example plugin installs without a network and is a method like any other."""

import json
import os
import shutil
import subprocess
import sys

import pytest

from alloc.problems import Instance
from alloc.problems.formats import write_instance


@pytest.fixture(scope="module")
def plugin(request, tmp_path_factory):
    """Install a copy of the plugin into a folder of its own; return the copy and an environment that sees it."""
    folder = tmp_path_factory.mktemp("plugin")
    source, target = folder / "source", folder / "site"
    shutil.copytree(request.config.rootpath / "examples" / "plugin", source)
    pip = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-build-isolation", "--no-index"]
    done = subprocess.run(
        [*pip, "--disable-pip-version-check", "--target", target, source], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return source, os.environ | {"PYTHONPATH": str(target)}


def run(plugin, *command):
    """Run a Python module where the plugin is installed."""
    source, environment = plugin
    return subprocess.run(
        [sys.executable, "-m", *map(str, command)],
        cwd=source,
        env=environment,
        capture_output=True,
        text=True,
        timeout=100,
        check=False,
    )


@pytest.fixture
def instance_file(tmp_path):
    write_instance(Instance(name="demo", ability=[5, 3, 3, 2, 1], workload=[6, 5, 3]), tmp_path / "demo.json")
    return tmp_path / "demo.json"


def test_solves_from_the_command_line(plugin, instance_file):
    """``alloc solve --method random-restart`` finds the optimum of a small instance."""
    done = run(plugin, "alloc.cli", "solve", instance_file, "--method", "random-restart", "--json")
    assert done.returncode == 0, done.stderr
    result = json.loads(done.stdout)
    assert result["method"] == "random-restart"
    assert result["makespan"] == pytest.approx(1.0)
    assert result["status"] == "optimal"


def test_refuses_unsupported_objectives(plugin, instance_file):
    """Its `Method` names one objective; the other is refused in one line."""
    done = run(
        plugin, "alloc.cli", "solve", instance_file, "--method", "random-restart", "--objective", "makespan-energy"
    )
    assert done.returncode == 2
    assert done.stdout == ""
    assert "random-restart" in done.stderr
    assert "Traceback" not in done.stderr


def test_is_listed(plugin):
    """``alloc methods`` shows it with its summary."""
    done = run(plugin, "alloc.cli", "methods", "--json")
    assert done.returncode == 0, done.stderr
    assert "random-restart" in done.stdout


@pytest.mark.slow
def test_passes_the_conformance_suite(plugin):
    """Its own tests, which subclass the suite, pass against the installed plugin."""
    done = run(plugin, "pytest", "-q", "-p", "no:cacheprovider", "tests")
    assert done.returncode == 0, done.stdout
    assert "passed" in done.stdout
