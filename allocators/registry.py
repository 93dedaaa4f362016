"""Methods by name, imported when they are needed; third parties add theirs by entry point."""

import importlib
from importlib.metadata import EntryPoint, entry_points
from typing import Any

from alloc.allocators.contract.base import Allocator
from alloc.allocators.contract.method import Kind, Method
from alloc.allocators.runtime.interrupts import ended_with_process
from alloc.problems import InputError, MissingPackageError
from alloc.problems.arguments import text
from alloc.problems.errors import nearest

ENTRY_POINT_GROUP = "alloc.allocators"

_TARGETS = {
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

BUILT_IN = {
    method.name: method
    for method in (
        Method(
            name="greedy",
            summary="largest ability first, to the task that is worst served",
            finite_speeds=True,
            citation="Deuermeyer, Friesen and Langston (1982), doi:10.1137/0603019",
        ),
        Method(
            name="local-search",
            summary="annealed exchanges between two groups, each shared out anew at the least price",
            requires=("numba",),
            finite_speeds=True,
            warm_start=True,
            anytime=True,
            makespan_slack=True,
            citation="Ahuja, Ergun, Orlin and Punnen (2002), doi:10.1016/S0166-218X(01)00338-9",
        ),
        Method(
            name="milp",
            summary="proven optimum by a mixed-integer programme over classes of agents (cvxpy + HiGHS)",
            kind=Kind.EXACT,
            requires=("cvxpy", "highspy"),
            finite_speeds=True,
            makespan_slack=True,
            proves=True,
            warm_start=True,
            anytime=True,
            citation="Huangfu and Hall (2018), doi:10.1007/s12532-017-0130-5",
        ),
        Method(
            name="cpsat",
            summary="proven optimum by constraint programming over classes of agents (OR-Tools)",
            kind=Kind.EXACT,
            requires=("ortools",),
            finite_speeds=True,
            makespan_slack=True,
            proves=True,
            warm_start=True,
            anytime=True,
            citation="Perron, Didier and Gay (2023), doi:10.4230/LIPIcs.CP.2023.3",
        ),
        Method(
            name="ga",
            summary="genetic algorithm over assignments (DEAP)",
            requires=("deap",),
            warm_start=True,
            anytime=True,
            citation="Fortin et al. (2012), JMLR 13:2171-2175",
        ),
        Method(
            name="hedonic",
            summary="decentralised coalition-formation game: agents decide on local communication (GRAPE)",
            makespan_slack=True,
            warm_start=True,
            anytime=True,
            options=("communication_radius",),
            citation="Jang, Shin and Tsourdos (2018), doi:10.1109/TRO.2018.2858292",
        ),
        Method(
            name="auction",
            summary="decentralised auction: tasks bid for agents until a deadline is met, then agents exchange places",
            makespan_slack=True,
            warm_start=True,
            anytime=True,
            citation="Bertsekas (1992), doi:10.1007/BF00247653",
        ),
        Method(
            name="lp-round",
            summary="linear programme over classes of agents, rounded by a matching, mended by local search",
            finite_speeds=True,
            makespan_slack=True,
            warm_start=True,
            anytime=True,
            citation="Shmoys and Tardos (1993), doi:10.1007/BF01585178",
        ),
        *(
            Method(
                name=name,
                summary=summary,
                kind=Kind.LEARNED,
                requires=("torch", "safetensors", *more),
                finite_speeds=True,
                makespan_slack=True,
                warm_start=True,
                anytime=True,
                options=("policy", "device"),
                citation=citation,
            )
            for name, summary, more, citation in (
                (
                    "gappo",
                    "learned policies: a population of actor-critics, trained by PPO and bred by a GA",
                    ("deap",),
                    "Fang et al. (2025), doi:10.20944/preprints202502.0192.v1",
                ),
                (
                    "gappo-ls",
                    "hybrid: the first plan of gappo, improved by local-search",
                    ("deap", "numba"),
                    "Fang et al. (2025), doi:10.20944/preprints202502.0192.v1",
                ),
                (
                    "ppo",
                    "learned policy: proximal policy optimisation",
                    (),
                    "Schulman et al. (2017), arXiv:1707.06347",
                ),
                (
                    "a2c",
                    "learned policy: advantage actor-critic",
                    (),
                    "Mnih et al. (2016), arXiv:1602.01783",
                ),
                (
                    "dqn",
                    "learned policy: deep Q-network",
                    (),
                    "Mnih et al. (2015), doi:10.1038/nature14236",
                ),
                (
                    "ddpg",
                    "learned policy: deep deterministic policy gradient, over relaxed choices",
                    (),
                    "Lillicrap et al. (2016), arXiv:1509.02971",
                ),
            )
        ),
    )
}


def names() -> list[str]:
    """Return the names of all methods: ours, then those of installed plugins."""
    return [*BUILT_IN, *_plugins()]


def describe(name: str) -> Method:
    """Return what is known of a method; ours are not imported for it, a plugin is.

    Raises
    ------
    InputError
        If there is no such method, or its plugin cannot be imported.
    """
    text(name, "name")
    return BUILT_IN[name] if name in BUILT_IN else _plugin_class(name).method


def load(name: str, **options: Any) -> Allocator:
    """Return a method, ready to be used many times and from several threads.

    Parameters
    ----------
    name : str
        One of `names`.
    **options
        Options of the method, such as ``policy`` of ``gappo``; those that are None are left out.

    Raises
    ------
    InputError
        If there is no such method, it takes no such option, or what it requires is not installed.
    """
    method = describe(name)
    given = {key: value for key, value in options.items() if value is not None}
    for key in given:
        if key not in method.options:
            raise InputError(f"method {name!r} takes no option {key!r}{_hint(key, method)}", key)
    if method.missing:
        modules = " ".join(method.missing)
        raise MissingPackageError(f"method {name!r} needs {modules}; install with: pip install {modules}", "method")
    if name not in BUILT_IN:
        return _plugin_class(name)(**given)
    if "policy" in given:
        from alloc.allocators.learned.files.policy_header import read_header

        read_header(given["policy"])  # what is no policy is told before the seconds that torch takes
    module, _, attribute = _TARGETS[name].partition(":")
    with ended_with_process(lambda: None):  # the import of a large library can only be awaited
        allocator = getattr(importlib.import_module(module), attribute)(**given)
    assert isinstance(allocator, Allocator)
    return allocator


def _hint(option: str, method: Method) -> str:
    """Say which option may be meant, or which of our methods takes this one."""
    takers = [other.name for other in BUILT_IN.values() if option in other.options]
    if takers:
        return f"; {', '.join(takers)} {'do' if len(takers) > 1 else 'does'}"
    return nearest(option, method.options) if method.options else ""


def _plugins() -> dict[str, EntryPoint]:
    """Entry points of other packages; a name of ours cannot be taken."""
    return {entry.name: entry for entry in entry_points(group=ENTRY_POINT_GROUP) if entry.name not in BUILT_IN}


def _plugin_class(name: str) -> type[Allocator]:
    plugins = _plugins()
    if name == "auto":
        raise InputError("'auto' is no method but picks one for an instance; call solve(instance, 'auto')", "method")
    if name not in plugins:
        raise InputError(f"there is no method {name!r}{nearest(name, [*BUILT_IN, *plugins, 'auto'])}", "method")
    try:
        plugin = plugins[name].load()
    except Exception as error:
        raise InputError(f"plugin {name!r} ({plugins[name].value}) cannot be imported: {error}", "method") from error
    if not (isinstance(plugin, type) and issubclass(plugin, Allocator) and hasattr(plugin, "method")):
        raise InputError(f"plugin {name!r} ({plugins[name].value}) is not an Allocator with a `method`", "method")
    return plugin
