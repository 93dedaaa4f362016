"""Parameters of methods, and the keywords that set them."""

from dataclasses import dataclass

import numpy as np
import pytest

from alloc.allocators.contract.parameters import CheckedParameters, Parameterised, bounded, with_settings
from alloc.problems import InputError


@dataclass(frozen=True)
class Sample(CheckedParameters):
    size: int = bounded(3, low=1, high=9)
    rate: float = bounded(0.5, low=0, above=True)
    radius: float | None = bounded(None, low=0, infinite=True)
    steps: tuple[float, ...] = bounded((0.1, 0.2), low=0)
    fast: bool = False
    name: str = "a"


def test_defaults_and_replacements():
    """Given settings replace fields of the given parameters, or else of the defaults."""
    assert with_settings(Sample, None, {}) == Sample()
    assert with_settings(Sample, Sample(size=4), {"name": "b"}) == Sample(size=4, name="b")


def test_defaults_of_a_class_with_slots():
    """Defaults and changed parameters are also found for classes with slots."""

    @dataclass(frozen=True, slots=True)
    class Slotted:
        size: int = 3
        name: str = "a"

    class Sized(Parameterised):
        parameters_type = Slotted

        @classmethod
        def _title(cls) -> str:
            return "method 'sized'"

    assert Sized.default_parameters() == {"size": 3, "name": "a"}
    assert Sized(size=4).changed_parameters() == {"size": 4}


def test_values_are_converted_to_python_types():
    """NumPy scalars, integers for floats and lists for tuples are converted."""
    settings = {"size": np.int64(2), "rate": 1, "radius": np.float32(2), "steps": [1, np.float64(2)], "fast": np.True_}
    found = with_settings(Sample, None, settings)
    assert found == Sample(2, 1.0, 2.0, (1.0, 2.0), True)
    assert [type(value) for value in (found.size, found.rate, found.radius, found.fast)] == [int, float, float, bool]
    assert with_settings(Sample, found, {"radius": None}).radius is None
    assert with_settings(Sample, found, {"radius": np.inf}).radius == np.inf


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("size", 0), ("size", 10), ("size", 2.0), ("size", True), ("size", None), ("rate", 0), ("rate", "1"),
        ("rate", np.inf), ("rate", np.nan), ("radius", -1), ("radius", np.nan), ("steps", ()),
        ("steps", (1, -1)), ("steps", 1), ("fast", 1), ("name", 3),
    ],
)  # fmt: skip
def test_wrong_values_are_errors_that_name_the_parameter(name, value):
    """A value of the wrong type or out of range is an error that names the parameter, however it is set."""
    with pytest.raises(InputError) as caught:
        with_settings(Sample, None, {name: value})
    assert caught.value.place == name
    with pytest.raises(InputError) as caught:
        Sample(**{name: value})
    assert caught.value.place == name


def test_unknown_names_get_a_hint():
    """An unknown parameter is an error that names it and a similar valid one."""
    with pytest.raises(InputError, match="'size'") as caught:
        with_settings(Sample, None, {"sise": 1})
    assert caught.value.place == "sise"


def test_parameters_of_another_method_are_refused():
    """Parameters of another type are refused."""
    with pytest.raises(InputError, match="parameters"):
        with_settings(Sample, "fast", {})  # type: ignore[type-var]
