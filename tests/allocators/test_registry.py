"""Methods by name, and their parameters."""

import sys
from dataclasses import dataclass
from functools import partial
from types import SimpleNamespace

import pytest

from alloc.allocators import (
    Allocator,
    GeneticAlgorithm,
    Method,
    Proposal,
    Result,
    Search,
    compare,
    describe,
    describe_parameters,
    load,
    method_parameters,
    names,
    registry,
    solve,
)
from alloc.allocators.contract.parameters import CheckedParameters, bounded
from alloc.problems import Allocation, InputError, Instance

TWO = Instance(ability=[5, 3], workload=[6, 4])


@pytest.mark.parametrize("name", list(registry.BUILT_IN))
def test_built_in_methods_load(name: str) -> None:
    """Every listed method can be loaded, and its description is that of its entry."""
    allocator = load(name)
    assert isinstance(allocator, Allocator)
    assert allocator.method is describe(name)
    assert name in names()
    assert allocator.method.citation


def test_unknown_names_get_a_hint() -> None:
    """A misspelled method or option gets the most similar name."""
    with pytest.raises(InputError, match="did you mean 'greedy'"):
        load("gredy")
    with pytest.raises(InputError, match="did you mean 'policy'"):
        load("gappo", polcy="x")
    for ask in (load, describe):
        with pytest.raises(InputError, match=r"picks one for an instance; call solve\(instance, 'auto'\)$"):
            ask("auto")


def test_options_of_other_methods_are_refused() -> None:
    """The error for an option of another method says which method takes it."""
    takers = "gappo, gappo-ls, ppo, a2c, dqn, ddpg do"
    with pytest.raises(InputError, match=rf"'greedy' takes no option 'policy'; {takers}$"):
        load("greedy", policy="x")
    with pytest.raises(InputError, match=r"'greedy' takes no option 'colour'$"):
        load("greedy", colour="x")


def test_options_of_none_are_ignored() -> None:
    """Options that a command line passes on without a value do not count."""
    assert load("greedy", policy=None).method.name == "greedy"


def test_missing_packages_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    """A method whose packages are not installed says what to install."""
    monkeypatch.setitem(registry.BUILT_IN, "greedy", Method(name="greedy", summary="", requires=("no_such_module",)))
    with pytest.raises(InputError, match="pip install no_such_module"):
        load("greedy")


@dataclass(frozen=True)
class Faces(CheckedParameters):
    """Parameters for tests."""

    faces: int = bounded(6, 1)
    bias: float = 0.0


class Dice(Allocator):
    """A method with parameters, as a plugin would have it."""

    method = Method(name="dice", summary="for tests")
    parameters_type = Faces
    parameters: Faces

    def allocate(self, search: Search) -> Proposal:
        return Proposal(Allocation.idle(search.instance), notes=(f"{self.parameters.faces} faces",))


@pytest.fixture
def dice(monkeypatch: pytest.MonkeyPatch) -> None:
    """Make `Dice` known by name."""
    monkeypatch.setitem(registry.BUILT_IN, "dice", Dice.method)
    monkeypatch.setitem(registry.TARGETS, "dice", f"{__name__}:Dice")
    monkeypatch.setitem(sys.modules, __name__, sys.modules.get(__name__) or SimpleNamespace(Dice=Dice))


@pytest.mark.usefixtures("dice")
def test_parameters_reach_the_method() -> None:
    """By name with one parameter, with all of them, or as an object: the method has the given values."""
    instance = Instance(ability=[1], workload=[1])
    for result in (
        solve(instance, "dice", faces=20),
        solve(instance, "dice", parameters=Faces(faces=20)),
        solve(instance, Dice(faces=20)),
        solve(instance, Dice(Faces(bias=1.0), faces=20)),
        solve(instance, load("dice", faces=20)),
    ):
        assert result.notes[0] == "20 faces"
    assert load("dice", Faces(bias=1.0), faces=3).parameters == Faces(faces=3, bias=1.0)
    assert method_parameters("dice") == {"faces": 6, "bias": 0.0}


@pytest.mark.usefixtures("dice")
@pytest.mark.parametrize(
    ("settings", "place", "words"),
    [
        ({"face": 3}, "face", "did you mean 'faces'"),
        ({"faces": 1.5}, "faces", "whole number"),
        ({"faces": 0}, "faces", ">= 1"),
        ({"bias": "much"}, "bias", "finite number"),
        ({"parameters": 5}, "parameters", "must be a Faces"),
    ],
)
def test_wrong_parameters_are_errors_that_name_them(settings: dict[str, object], place: str, words: str) -> None:
    """An unknown name gets the most similar one, a wrong value its parameter, in `load`, `solve` and the class."""
    for run in (partial(load, "dice"), partial(solve, Instance(ability=[1], workload=[1]), "dice")):
        with pytest.raises(InputError, match=words) as caught:
            run(**settings)
        assert caught.value.place == place
    if place != "face":
        with pytest.raises(InputError, match=words):
            Dice(**settings)


def test_parameters_of_methods_without_any_are_refused() -> None:
    """Parameters that would be ignored are an error."""

    class Plain(Allocator):
        method = Method(name="plain", summary="for tests")

        def allocate(self, search: Search) -> Proposal:
            return Proposal()

    for wrong in ({"parameters": 5}, {"faces": 5}):
        with pytest.raises(InputError, match="has no parameters"):
            Plain(**wrong)


def test_parameters_of_every_method_can_be_listed() -> None:
    """Each built-in method lists its parameters, with valid defaults."""
    assert {"policy": None, "device": "cpu"}.items() <= method_parameters("gappo").items()
    for name in ("greedy", "local-search", "ga", "hedonic", "auction", "lp-round"):
        load(name, **method_parameters(name))


@pytest.mark.parametrize("name", list(registry.BUILT_IN))
def test_every_parameter_is_described(name: str) -> None:
    """Each parameter of each built-in method has values, a default and a meaning in its docstring."""
    found = describe_parameters(name)
    assert {one.name: one.default for one in found} == method_parameters(name)
    assert [one.name for one in found if not (one.meaning and one.kind)] == []


def test_unknown_parameter_error_lists_all_parameters() -> None:
    """For an unknown and for a misspelled name, the error lists all parameters in one line."""
    for given in ("colour", "populatoin"):
        with pytest.raises(InputError, match=r"known are population, population_genes, .*distance_weight$") as caught:
            solve(TWO, "ga", parameters={given: 1})
        assert caught.value.place == given
        assert "\n" not in str(caught.value)


def test_parameters_are_in_the_result_and_its_label() -> None:
    """However parameters are given, the result has those that differ from their defaults, and reads them back."""
    ways = [
        solve(TWO, "ga", iterations=1, parameters={"population": 8, "smallest": 16}),
        solve(TWO, "ga", iterations=1, population=8),
        solve(TWO, GeneticAlgorithm(population=8), iterations=1),
    ]
    for result in ways:
        assert (dict(result.parameters), result.label) == ({"population": 8}, "ga[population=8]")
        assert result.to_dict()["parameters"] == {"population": 8}
        assert Result.from_dict(result.to_dict(), TWO).to_dict() == result.to_dict()
    assert "parameters" not in solve(TWO, "ga", iterations=1).to_dict()
    several = solve(TWO, "hedonic", iterations=1, communication_radius=float("inf"))
    assert several.to_dict()["parameters"] == {"communication_radius": "inf"}


def test_rows_of_one_method_are_labelled_by_parameters() -> None:
    """Two allocators of one method have separate rows, named as ``alloc compare`` accepts them."""
    rows = list(compare([TWO], [GeneticAlgorithm(population=8), GeneticAlgorithm()], iterations=1))
    assert [row.method for row in rows] == ["ga[population=8]", "ga"]
