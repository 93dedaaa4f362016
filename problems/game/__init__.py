"""The Markov game of the paper (section 2.2), batched in torch.

States, not observations, are kept in trajectories: what agents see is a pure function of `Board` and `State`.

References
----------
Fang et al. (2025), section 2.2 and equations (1)-(8), doi:10.20944/preprints202502.0192.v1. That agents take turns by
bidding, instead of all choosing at once, is ours.
"""

from alloc.problems.game.board import Board, make_board
from alloc.problems.game.observation import (
    AGENT_FEATURES,
    FEATURE_SET,
    PAIR_FEATURES,
    TASK_FEATURES,
    observe_agents,
    observe_pairs,
    observe_tasks,
)
from alloc.problems.game.reward import (
    coverage,
    difference_rewards,
    marginal_contributions,
    potential,
    time_over_reference,
    worth,
)
from alloc.problems.game.rules import (
    PAPER,
    PLANNING,
    Rules,
    State,
    battery_left,
    begin,
    flown,
    grant,
    group_ability,
    hop,
    moved,
    open_bids,
    pick,
    step,
    sum_by_place,
    tasks_of,
)
from alloc.problems.vocabulary import Reward, Turn

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
    "Turn",
    "battery_left",
    "begin",
    "coverage",
    "difference_rewards",
    "flown",
    "grant",
    "group_ability",
    "hop",
    "make_board",
    "marginal_contributions",
    "moved",
    "observe_agents",
    "observe_pairs",
    "observe_tasks",
    "open_bids",
    "pick",
    "potential",
    "step",
    "sum_by_place",
    "tasks_of",
    "time_over_reference",
    "worth",
]
