"""Allocation methods behind a common contract; `solve` runs any of them and scores its answer.

Method classes, `plot`, `train` and the like are imported on first use, as they need large libraries.
"""

import importlib
from typing import TYPE_CHECKING

from alloc.allocators.contract.base import Allocator, Proposal
from alloc.allocators.contract.budget import Budget, StopReason
from alloc.allocators.contract.described import Parameter
from alloc.allocators.contract.improvement import Improvement, TracePoint
from alloc.allocators.contract.method import Kind, Method
from alloc.allocators.contract.search import Search
from alloc.allocators.contract.status import Status
from alloc.allocators.contract.tolerance import MakespanTolerance
from alloc.allocators.experiments.compare import Row, compare
from alloc.allocators.experiments.fleets import Fleet
from alloc.allocators.experiments.whatif import WhatIf, whatif
from alloc.allocators.explain import Bottleneck, explain
from alloc.allocators.pareto import Front, pareto
from alloc.allocators.registry import TARGETS, describe, describe_parameters, load, method_parameters, names
from alloc.allocators.replanning.moves import Moves
from alloc.allocators.replanning.reasons import reasons_of_moves
from alloc.allocators.result import Result, read_result
from alloc.allocators.serving.asynchronous import solve_async
from alloc.allocators.solve import solve
from alloc.problems import AllocError, InputError, MissingPackageError, RefusedError, TrainingError

if TYPE_CHECKING:
    from alloc.allocators.exact.cpsat import CpSat
    from alloc.allocators.exact.milp import Milp
    from alloc.allocators.experiments.differences import Interval, PolicyDifference, paired_differences
    from alloc.allocators.experiments.policies import PolicyRow, compare_policies
    from alloc.allocators.experiments.report.page.page import report_html
    from alloc.allocators.heuristic.decentralised.auction import Auction
    from alloc.allocators.heuristic.decentralised.hedonic import Hedonic
    from alloc.allocators.heuristic.genetic.algorithm import GeneticAlgorithm
    from alloc.allocators.heuristic.greedy.list_schedule import Greedy
    from alloc.allocators.heuristic.local_search.allocator import LocalSearch
    from alloc.allocators.heuristic.lp_rounding.allocator import LpRound
    from alloc.allocators.learned.policy import A2c, Ddpg, Dqn, Gappo, GappoLs, Ppo
    from alloc.allocators.learned.training import train
    from alloc.allocators.online.contract import AgentDecider, Briefing, FleetDecider, Policy, PolicyError, PolicyInfo
    from alloc.allocators.online.planner.inputs import Report
    from alloc.allocators.online.planner.plan import OrderChange, Plan
    from alloc.allocators.online.planner.planner import MissionPlanner
    from alloc.allocators.online.registry import describe_policy, load_policy, policy_names
    from alloc.allocators.online.run import MissionRun, simulate
    from alloc.allocators.plan.files import write_result
    from alloc.allocators.plotting import animate_mission, plot, plot_convergence, plot_mission

__all__ = [
    "A2c",
    "AgentDecider",
    "AllocError",
    "Allocator",
    "Auction",
    "Bottleneck",
    "Briefing",
    "Budget",
    "CpSat",
    "Ddpg",
    "Dqn",
    "Fleet",
    "FleetDecider",
    "Front",
    "Gappo",
    "GappoLs",
    "GeneticAlgorithm",
    "Greedy",
    "Hedonic",
    "Improvement",
    "InputError",
    "Interval",
    "Kind",
    "LocalSearch",
    "LpRound",
    "MakespanTolerance",
    "Method",
    "Milp",
    "MissingPackageError",
    "MissionPlanner",
    "MissionRun",
    "Moves",
    "OrderChange",
    "Parameter",
    "Plan",
    "Policy",
    "PolicyDifference",
    "PolicyError",
    "PolicyInfo",
    "PolicyRow",
    "Ppo",
    "Proposal",
    "RefusedError",
    "Report",
    "Result",
    "Row",
    "Search",
    "Status",
    "StopReason",
    "TracePoint",
    "TrainingError",
    "WhatIf",
    "animate_mission",
    "compare",
    "compare_policies",
    "describe",
    "describe_parameters",
    "describe_policy",
    "explain",
    "load",
    "load_policy",
    "method_parameters",
    "names",
    "paired_differences",
    "pareto",
    "plot",
    "plot_convergence",
    "plot_mission",
    "policy_names",
    "read_result",
    "reasons_of_moves",
    "report_html",
    "simulate",
    "solve",
    "solve_async",
    "train",
    "whatif",
    "write_result",
]

_LAZY = {
    **{target.partition(":")[2]: target.partition(":")[0] for target in TARGETS.values()},
    "animate_mission": "alloc.allocators.plotting",
    "plot": "alloc.allocators.plotting",
    "plot_convergence": "alloc.allocators.plotting",
    "plot_mission": "alloc.allocators.plotting",
    "train": "alloc.allocators.learned.training",
    "write_result": "alloc.allocators.plan.files",
    "PolicyDifference": "alloc.allocators.experiments.differences",
    "Interval": "alloc.allocators.experiments.differences",
    "PolicyRow": "alloc.allocators.experiments.policies",
    "compare_policies": "alloc.allocators.experiments.policies",
    "paired_differences": "alloc.allocators.experiments.differences",
    "AgentDecider": "alloc.allocators.online.contract",
    "Briefing": "alloc.allocators.online.contract",
    "FleetDecider": "alloc.allocators.online.contract",
    "MissionPlanner": "alloc.allocators.online.planner.planner",
    "OrderChange": "alloc.allocators.online.planner.plan",
    "Plan": "alloc.allocators.online.planner.plan",
    "Report": "alloc.allocators.online.planner.inputs",
    "MissionRun": "alloc.allocators.online.run",
    "Policy": "alloc.allocators.online.contract",
    "PolicyError": "alloc.allocators.online.contract",
    "PolicyInfo": "alloc.allocators.online.contract",
    "describe_policy": "alloc.allocators.online.registry",
    "load_policy": "alloc.allocators.online.registry",
    "policy_names": "alloc.allocators.online.registry",
    "report_html": "alloc.allocators.experiments.report.page.page",
    "simulate": "alloc.allocators.online.run",
}
"""Modules of the public names that are imported on first use."""


def __getattr__(name: str) -> object:
    if name not in _LAZY:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(_LAZY[name]), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
