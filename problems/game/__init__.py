"""The Markov game of the paper (section 2.2), batched in torch.

Trajectories store states instead of observations, which are a pure function of `Board` and `State`.

References
----------
Fang et al. (2025), section 2.2 and equations (1)-(8), doi:10.20944/preprints202502.0192.v1. Bidding, as an
alternative to simultaneous choices, is ours.
"""

from alloc.problems.game.board import Board
from alloc.problems.game.features import AGENT_FEATURES, FEATURE_SET, PAIR_FEATURES, TASK_FEATURES
from alloc.problems.game.layout import make_board
from alloc.problems.game.observation import observe_agents, observe_pairs, observe_tasks
from alloc.problems.game.reward import (
    coverage,
    difference_rewards,
    marginal_contributions,
    potential,
    relative_makespan,
    utility,
)
from alloc.problems.game.rules import (
    PAPER,
    PLANNING,
    Rules,
    State,
    action_mask,
    apply_moves,
    at_slot,
    battery_left,
    current_tasks,
    grant_bids,
    group_ability,
    hop_distance,
    mean_distance,
    reset,
    step,
    sum_by_place,
)
from alloc.problems.vocabulary import Reward, TurnRule

__all__ = [
    "AGENT_FEATURES",
    "FEATURE_SET",
    "PAIR_FEATURES",
    "PAPER",
    "PLANNING",
    "TASK_FEATURES",
    "Board",
    "Reward",
    "Rules",
    "State",
    "TurnRule",
    "action_mask",
    "apply_moves",
    "at_slot",
    "battery_left",
    "coverage",
    "current_tasks",
    "difference_rewards",
    "grant_bids",
    "group_ability",
    "hop_distance",
    "make_board",
    "marginal_contributions",
    "mean_distance",
    "observe_agents",
    "observe_pairs",
    "observe_tasks",
    "potential",
    "relative_makespan",
    "reset",
    "step",
    "sum_by_place",
    "utility",
]
