"""Methods by name, imported on first use; other packages add theirs by entry points."""

from collections.abc import Mapping
from importlib.metadata import EntryPoint
from typing import cast

from alloc.allocators.contract.base import Allocator
from alloc.allocators.contract.built_in import BUILT_IN
from alloc.allocators.contract.described import Parameter, described
from alloc.allocators.contract.method import Method
from alloc.allocators.contract.plugins import imported, plugin_class, plugins, require_installed
from alloc.allocators.runtime.interrupts import stopped_at_exit
from alloc.problems import InputError
from alloc.problems.arguments import text
from alloc.problems.errors import nearest, of_these

__all__ = [
    "BUILT_IN",
    "ENTRY_POINT_GROUP",
    "TARGETS",
    "describe",
    "describe_parameters",
    "load",
    "method_parameters",
    "names",
]

ENTRY_POINT_GROUP = "alloc.allocators"

TARGETS = {
    "greedy": "alloc.allocators.heuristic.greedy.list_schedule:Greedy",
    "local-search": "alloc.allocators.heuristic.local_search.allocator:LocalSearch",
    "milp": "alloc.allocators.exact.milp:Milp",
    "cpsat": "alloc.allocators.exact.cpsat:CpSat",
    "ga": "alloc.allocators.heuristic.genetic.algorithm:GeneticAlgorithm",
    "hedonic": "alloc.allocators.heuristic.decentralised.hedonic:Hedonic",
    "auction": "alloc.allocators.heuristic.decentralised.auction:Auction",
    "lp-round": "alloc.allocators.heuristic.lp_rounding.allocator:LpRound",
    "gappo": "alloc.allocators.learned.policy:Gappo",
    "gappo-ls": "alloc.allocators.learned.policy:GappoLs",
    "ppo": "alloc.allocators.learned.policy:Ppo",
    "a2c": "alloc.allocators.learned.policy:A2c",
    "dqn": "alloc.allocators.learned.policy:Dqn",
    "ddpg": "alloc.allocators.learned.policy:Ddpg",
}


def names() -> list[str]:
    """Return the names of all methods.

    Returns
    -------
    list of str
        Built-in methods, then those of installed plugins.
    """
    return [*BUILT_IN, *_plugins()]


def describe(name: str) -> Method:
    """Return the description of a method; plugins are imported for it, built-in methods are not.

    Parameters
    ----------
    name : str
        One of `names`.

    Returns
    -------
    Method

    Raises
    ------
    InputError
        If there is no such method, or its plugin cannot be imported.
    """
    text(name, "name")
    return BUILT_IN[name] if name in BUILT_IN else _plugin_class(name).method


def load(name: str, parameters: object = None, **settings: object) -> Allocator:
    """Load a method; the allocator can be used many times, and from several threads.

    Parameters
    ----------
    name : str
        One of `names`.
    parameters : object, optional
        All parameters of the method, as an instance of its `Allocator.parameters_type`, or a mapping of some by name.
    **settings
        Single parameters by name, such as ``population`` of ``ga`` or ``policy`` of ``gappo``; None for the default.

    Returns
    -------
    Allocator

    Raises
    ------
    InputError
        If the method or a parameter is unknown, or a value is wrong.
    MissingPackageError
        If a required package is not installed.
    """
    method = describe(name)
    if isinstance(parameters, Mapping):
        settings, parameters = {**_named(parameters), **settings}, None
    given = {key: value for key, value in settings.items() if value is not None}
    require_installed(method.missing, f"method {name!r}", "method")
    if "policy" in given and "policy" in method.options:
        from alloc.allocators.learned.files.policy_header import read_header

        read_header(cast("str", given["policy"]))  # report a wrong file before torch is loaded, which takes seconds
    with stopped_at_exit(lambda: None):  # the import of a large library cannot be interrupted
        kind = _class(name)
        for key in given:
            if key not in method.options and key not in kind.default_parameters():
                raise InputError(f"method {name!r} takes no option {key!r}{_hint(key, method, kind)}", key)
        if parameters is None:
            return kind(**given)
        if kind.parameters_type is None:
            raise InputError(f"method {name!r} has no parameters", "parameters")
        return kind(parameters=parameters, **given)


def method_parameters(name: str) -> dict[str, object]:
    """Return the parameters of a method with their defaults; its class is imported.

    Parameters
    ----------
    name : str
        One of `names`.

    Returns
    -------
    dict
        Default value by parameter name, as `load` and `solve` accept them.

    Raises
    ------
    InputError
        If there is no such method.
    MissingPackageError
        If a required package is not installed.
    """
    return {parameter.name: parameter.default for parameter in describe_parameters(name)}


def describe_parameters(name: str) -> tuple[Parameter, ...]:
    """Return the parameters of a method with types, ranges, defaults and meanings; its class is imported.

    Parameters
    ----------
    name : str
        One of `names`.

    Returns
    -------
    tuple of Parameter

    Raises
    ------
    InputError
        If there is no such method.
    MissingPackageError
        If a required package is not installed.
    """
    require_installed(describe(name).missing, f"method {name!r}", "method")
    return described(_class(name))


def _named(parameters: Mapping[str, object]) -> dict[str, object]:
    """Return parameters that were given as a mapping."""
    return {text(key, "parameters"): value for key, value in parameters.items()}


def _class(name: str) -> type[Allocator]:
    """Import the class of a method."""
    if name not in BUILT_IN:
        return _plugin_class(name)
    return cast("type[Allocator]", imported(TARGETS[name]))


def _hint(key: str, method: Method, kind: type[Allocator]) -> str:
    """Return which built-in methods have this option, or else the closest option and all options of this method."""
    found = takers(key)
    if found:
        return f"; {', '.join(found)} {'do' if len(found) > 1 else 'does'}"
    return of_these(key, list(dict.fromkeys([*method.options, *kind.default_parameters()])))


def takers(option: str) -> list[str]:
    """Return the built-in methods that take an option.

    Parameters
    ----------
    option : str
        Name of the option, such as ``policy``.
    """
    return [method.name for method in BUILT_IN.values() if option in method.options]


def _plugins() -> dict[str, EntryPoint]:
    return plugins(ENTRY_POINT_GROUP, BUILT_IN)


def _plugin_class(name: str) -> type[Allocator]:
    found = _plugins()
    if name == "auto":
        raise InputError(
            "'auto' is not a method, but picks one for an instance; call solve(instance, 'auto')", "method"
        )
    if name not in found:
        raise InputError(f"there is no method {name!r}{nearest(name, [*BUILT_IN, *found, 'auto'])}", "method")
    return plugin_class(found, name, Allocator, "method", "an Allocator with a `method`", "method")  # type: ignore[type-abstract]
