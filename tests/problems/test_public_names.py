"""Public names of `alloc.problems`, and the modules that they load."""

import subprocess
import sys

import pytest

import alloc.problems


def test_every_public_name_resolves() -> None:
    """Each name in `__all__` exists, is listed by `dir`, and has a docstring or is a number."""
    for name in alloc.problems.__all__:
        value = getattr(alloc.problems, name)
        assert name in dir(alloc.problems)
        assert isinstance(value, int) or value.__doc__


def test_unknown_names_are_attribute_errors() -> None:
    """An unknown name is the usual attribute error."""
    with pytest.raises(AttributeError, match=r"module 'alloc\.problems' has no attribute 'Instanse'"):
        alloc.problems.Instanse  # noqa: B018 - the access is what is tested


def test_vocabulary_and_errors_load_no_numpy() -> None:
    """The command line can name objectives and report errors without waiting for numpy."""
    code = (
        "import sys\nfrom alloc.problems import InputError, Objective\n"
        "from alloc.problems.vocabulary import Distribution, Sites, Starts\nsys.exit('numpy' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
