"""Parameters of methods: frozen dataclasses whose fields are also keyword arguments of the method's constructor."""

import dataclasses
import math
import types
from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, ClassVar, TypeVar, get_args, get_origin, get_type_hints

from alloc.problems import InputError
from alloc.problems.arguments import flag, listed, of_type, real, shown, text, whole
from alloc.problems.errors import of_these

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

P = TypeVar("P", bound="DataclassInstance")
Value = TypeVar("Value")


def with_settings(parameters_type: type[P], parameters: P | None, settings: Mapping[str, object]) -> P:
    """Return checked parameters with some fields replaced.

    Parameters
    ----------
    parameters_type : type
        A frozen dataclass whose fields have defaults and are annotated with int, float, bool, str, a tuple of one of
        these (``tuple[float, ...]``), or one of these and None.
    parameters : P or None
        Values of the other fields; None for the defaults.
    settings : mapping of str to object
        Values by field name; numpy scalars are converted to Python's own types.

    Raises
    ------
    InputError
        If a name is unknown, or a value has the wrong type or is out of range.
    """
    start = parameters_type() if parameters is None else of_type(parameters, parameters_type, "parameters")
    hints = get_type_hints(parameters_type)
    names = [field.name for field in dataclasses.fields(parameters_type)]
    for name in settings:
        if name not in names:
            raise InputError(f"is not a parameter of this method{of_these(name, names)}", name)
    if not issubclass(parameters_type, CheckedParameters):  # those check themselves, including ranges
        settings = {name: _converted(value, hints[name], name, infinite=True) for name, value in settings.items()}
    return dataclasses.replace(start, **settings)


def bounded(
    default: Value, low: float = -math.inf, high: float = math.inf, *, above: bool = False, infinite: bool = False
) -> Value:
    """Return a dataclass field for `CheckedParameters` with a default and a range.

    Parameters
    ----------
    default : Value
    low, high : float
        Range of the value, or of each entry of a tuple.
    above : bool
        Whether `low` itself is excluded.
    infinite : bool
        Whether infinity is allowed.
    """
    limits = {"low": low, "high": high, "above": above, "infinite": infinite}
    field: Any = dataclasses.field(default=default, metadata=limits)
    return field  # type: ignore[no-any-return]


@dataclasses.dataclass(frozen=True)
class CheckedParameters:
    """Base class of parameters that check their types, and the ranges declared by `bounded`, on creation."""

    def __post_init__(self) -> None:
        hints = get_type_hints(type(self))
        for field in dataclasses.fields(self):
            value = _converted(getattr(self, field.name), hints[field.name], field.name, **field.metadata)
            object.__setattr__(self, field.name, value)


def plain_values(parameters: Mapping[str, object]) -> dict[str, object]:
    """Return parameters as JSON values: tuples as lists, paths and infinity as text."""
    return {name: _plain(value) for name, value in parameters.items()}


def _plain(value: object) -> object:
    if isinstance(value, tuple | list):
        return [_plain(entry) for entry in value]
    if value is None or isinstance(value, bool | int | str) or (isinstance(value, float) and math.isfinite(value)):
        return value
    return str(value)


def labelled_method(name: str, parameters: Mapping[str, object]) -> str:
    """Return a method with parameters in the syntax of ``alloc compare``, such as ``ga[population=200]``."""
    settings = ",".join(f"{key}={written(value)}" for key, value in parameters.items())
    return f"{name}[{settings}]" if settings else name


def written(value: object) -> str:
    """Return the value of a parameter in the syntax of ``--set``."""
    if isinstance(value, tuple | list):
        return ",".join(map(written, value)) + ("," if len(value) == 1 else "")
    return str(value).lower() if value is None or isinstance(value, bool) else str(value)


class Parameterised(ABC):
    """Base class of `Allocator` and `Policy`: its parameters, if any, are a frozen dataclass."""

    parameters_type: ClassVar[type[Any] | None] = None

    def __init__(self, parameters: object = None, **settings: object) -> None:
        if self.parameters_type is not None:
            self.parameters = with_settings(self.parameters_type, parameters, settings)
        elif parameters is not None or settings:
            raise InputError(f"{self._title()} has no parameters", next(iter(settings), "parameters"))

    @classmethod
    def default_parameters(cls) -> dict[str, object]:
        """Return the default of each parameter by name; empty if there are no parameters."""
        if cls.parameters_type is None:
            return {}
        defaults = cls.parameters_type()
        return {field.name: getattr(defaults, field.name) for field in dataclasses.fields(defaults)}

    def changed_parameters(self) -> dict[str, object]:
        """Return the parameters that differ from their defaults, by name."""
        defaults = self.default_parameters()
        return {
            name: getattr(self.parameters, name)
            for name, value in defaults.items()
            if getattr(self.parameters, name) != value
        }

    @classmethod
    @abstractmethod
    def _title(cls) -> str:
        """Return how messages refer to it, such as ``method 'greedy'``."""


def _converted(
    value: object,
    hint: Any,
    name: str,
    low: float = -math.inf,
    high: float = math.inf,
    above: bool = False,
    infinite: bool = False,
) -> object:
    """Convert a value to the built-in type `hint`, and check its type and range."""
    kinds = get_args(hint) if get_origin(hint) is types.UnionType else (hint,)
    if value is None and types.NoneType in kinds:
        return None
    kind = next(one for one in kinds if one is not types.NoneType)
    if get_origin(kind) is tuple:
        entries: list[object] = listed(value, name, "numbers")  # type: ignore[arg-type]
        if not entries:
            raise InputError("must not be empty", name)
        return tuple(_converted(entry, get_args(kind)[0], name, low, high, above, infinite) for entry in entries)
    if kind is bool:
        return flag(value, name)
    if kind is int:
        least = None if low == -math.inf else int(low) + above
        return whole(value, name, least, None if high == math.inf else int(high))
    if kind is float:
        if infinite and value == math.inf:
            return math.inf
        return float(real(value, name, low, high, above=above))
    if kind is str:
        return text(value, name)
    raise TypeError(f"{name} has a type that cannot be set: {shown(hint)}")
