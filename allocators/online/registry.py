"""Policies by name, imported on first use; third parties add theirs by entry point."""

import importlib
from importlib.metadata import EntryPoint, entry_points

from alloc.allocators.online.contract import Policy, PolicyInfo
from alloc.problems import InputError, MissingPackageError
from alloc.problems.arguments import text
from alloc.problems.errors import nearest

ENTRY_POINT_GROUP = "alloc.policies"

POLICIES = {
    "idle": "alloc.allocators.online.policies.simple:Idle",
    "random": "alloc.allocators.online.policies.simple:RandomTask",
    "nearest": "alloc.allocators.online.policies.simple:Nearest",
    "greedy": "alloc.allocators.online.policies.greedy:GreedyUtility",
    "hedonic": "alloc.allocators.online.policies.hedonic:HedonicCoalitions",
    "auction": "alloc.allocators.online.policies.auction:ConsensusAuction",
    "replan": "alloc.allocators.online.policies.replan:Replan",
    "routes": "alloc.allocators.online.policies.routes:Routes",
    "clairvoyant": "alloc.allocators.online.policies.clairvoyant:Clairvoyant",
}


def policy_names() -> list[str]:
    """Return the names of all policies.

    Returns
    -------
    list of str
        Those built in, then those of installed plugins.
    """
    return [*POLICIES, *_plugins()]


def describe_policy(name: str) -> PolicyInfo:
    """Return the description of a policy.

    Parameters
    ----------
    name : str
        One of `policy_names`.

    Returns
    -------
    PolicyInfo

    Raises
    ------
    InputError
        If there is no such policy, or its plugin cannot be imported.
    """
    return _class(name).info


def load_policy(name: str, parameters: object = None, **settings: object) -> Policy:
    """Return a policy, ready to be used in many missions.

    Parameters
    ----------
    name : str
        One of `policy_names`.
    parameters : object, optional
        All parameters of the policy.
    **settings
        Single ones by name; None stands for the default.

    Returns
    -------
    Policy

    Raises
    ------
    InputError
        If there is no such policy, it has no such parameter, or a value is wrong.
    MissingPackageError
        If what it requires is not installed.
    """
    kind = _class(name)
    if kind.info.missing:
        modules = " ".join(kind.info.missing)
        raise MissingPackageError(f"policy {name!r} needs {modules}; install with: pip install {modules}", "policy")
    given = {key: value for key, value in settings.items() if value is not None}
    known = [*kind.info.options, *kind.default_parameters()]
    for key in given:
        if key not in known:
            raise InputError(f"policy {name!r} takes no option {key!r}{nearest(key, known)}", key)
    if parameters is None:
        return kind(**given)
    return kind(parameters, **given)


def _class(name: str) -> type[Policy]:
    text(name, "policy")
    if name in POLICIES:
        module, _, attribute = POLICIES[name].partition(":")
        kind: type[Policy] = getattr(importlib.import_module(module), attribute)
        return kind
    plugins = _plugins()
    if name not in plugins:
        raise InputError(f"there is no policy {name!r}{nearest(name, [*POLICIES, *plugins])}", "policy")
    try:
        plugin = plugins[name].load()
    except Exception as error:
        raise InputError(f"plugin {name!r} ({plugins[name].value}) cannot be imported: {error}", "policy") from error
    if not (isinstance(plugin, type) and issubclass(plugin, Policy) and hasattr(plugin, "info")):
        raise InputError(f"plugin {name!r} ({plugins[name].value}) is not a Policy with an `info`", "policy")
    return plugin


def _plugins() -> dict[str, EntryPoint]:
    """Return the entry points of other packages; the name of a built-in policy cannot be taken."""
    return {entry.name: entry for entry in entry_points(group=ENTRY_POINT_GROUP) if entry.name not in POLICIES}
