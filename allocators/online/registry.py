"""Registry of policies by name: imported on first use, extended by third parties through entry points."""

from importlib.metadata import EntryPoint
from typing import cast

from alloc.allocators.contract.plugins import imported, plugin_class, plugins, require_installed
from alloc.allocators.online.contract import Policy, PolicyInfo
from alloc.problems import InputError
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
    "gappo": "alloc.allocators.online.policies.gappo:NetworkPolicy",
    "ppo": "alloc.allocators.online.policies.gappo:PpoPolicy",
    "replan": "alloc.allocators.online.policies.replan:Replan",
    "routes": "alloc.allocators.online.policies.routes:Routes",
    "local-routes": "alloc.allocators.online.policies.local_routes:LocalRoutes",
    "clairvoyant": "alloc.allocators.online.policies.clairvoyant:Clairvoyant",
}


def policy_names() -> list[str]:
    """Return the names of all policies.

    Returns
    -------
    list of str
        Built-in policies, then those of installed plugins.
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
    """Load a policy, ready for use in any number of missions.

    Parameters
    ----------
    name : str
        One of `policy_names`.
    parameters : object, optional
        All parameters of the policy.
    **settings
        Single parameters by name; None stands for the default.

    Returns
    -------
    Policy

    Raises
    ------
    InputError
        If the policy or a parameter is unknown, or a value is invalid.
    MissingPackageError
        If a required package is not installed.
    """
    kind = _class(name)
    require_installed(kind.info.missing, f"policy {name!r}", "policy")
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
        return cast("type[Policy]", imported(POLICIES[name]))
    found = _plugins()
    if name not in found:
        raise InputError(f"there is no policy {name!r}{nearest(name, [*POLICIES, *found])}", "policy")
    return plugin_class(found, name, Policy, "info", "a Policy with an `info`", "policy")  # type: ignore[type-abstract]


def _plugins() -> dict[str, EntryPoint]:
    return plugins(ENTRY_POINT_GROUP, POLICIES)
