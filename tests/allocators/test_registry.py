"""Methods by name."""

import pytest

from alloc.allocators import Allocator, Method, describe, load, names, registry
from alloc.problems import InputError


@pytest.mark.parametrize("name", list(registry.BUILT_IN))
def test_ours_load(name: str) -> None:
    """Every method that is listed can be loaded, and is described by the very entry it is listed under."""
    allocator = load(name)
    assert isinstance(allocator, Allocator)
    assert allocator.method is describe(name)
    assert name in names()
    assert allocator.method.citation


def test_unknown_names() -> None:
    """A slip gets the nearest name, for methods and options."""
    with pytest.raises(InputError, match="did you mean 'greedy'"):
        load("gredy")
    with pytest.raises(InputError, match="did you mean 'policy'"):
        load("gappo", polcy="x")
    for ask in (load, describe):
        with pytest.raises(InputError, match=r"picks one for an instance; call solve\(instance, 'auto'\)$"):
            ask("auto")


def test_options_of_other_methods() -> None:
    """Whoever gives an option to the wrong method hears which one takes it, and no empty list of what is known."""
    takers = "gappo, gappo-ls, ppo, a2c, dqn, ddpg do"
    with pytest.raises(InputError, match=rf"'greedy' takes no option 'policy'; {takers}$"):
        load("greedy", policy="x")
    with pytest.raises(InputError, match=r"'greedy' takes no option 'colour'$"):
        load("greedy", colour="x")


def test_options_that_are_none_are_left_out() -> None:
    """A command line passes on all its options; those not given do not count."""
    assert load("greedy", policy=None).method.name == "greedy"


def test_what_is_missing_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    """A method whose modules are not installed says what to install."""
    monkeypatch.setitem(registry.BUILT_IN, "greedy", Method(name="greedy", summary="", requires=("no_such_module",)))
    with pytest.raises(InputError, match="pip install no_such_module"):
        load("greedy")
