"""Features of policies: names, indices and scaling, shared by torch and compiled code.

Features of a move are about the agent's *own* place and a *candidate*. The shortfall of a place is its need minus the
ability there, negative for a surplus; the contribution is the agent's ability there; "after" means after the move.
"""

from enum import IntEnum

FEATURE_SET = "bidding-3"
"""Name of this feature set; policies trained with another one are rejected."""

FEATURE_LIMIT = 2.0
"""Features are clipped to [-FEATURE_LIMIT, FEATURE_LIMIT]."""

IDLE_SURPLUS = 1e6
"""Surplus of ability at idle, so that leaving it costs nothing."""

LOG_NEED_OFFSET = 1.5
"""Offset that centres logarithms of needs and of group sizes."""

SHORTFALL_DIVISOR = 3.0
"""Divisor of shortfalls in units of ability."""

FINE_FACTOR = 5.0
"""Factor on relative shortfalls, to resolve small ones."""


class PairFeature(IntEnum):
    """Features of an agent and a candidate."""

    SHORTFALL_PER_CONTRIBUTION = 0
    SHORTFALL_AFTER_PER_CONTRIBUTION = 1
    OWN_SHORTFALL_PER_CONTRIBUTION = 2
    OWN_SHORTFALL_AFTER_PER_CONTRIBUTION = 3
    SHORTFALL_PER_NEED = 4
    SHORTFALL_AFTER_PER_NEED = 5
    OWN_SHORTFALL_PER_NEED = 6
    OWN_SHORTFALL_AFTER_PER_NEED = 7
    EXTRA_DISTANCE = 8
    DISTANCE = 9
    EXTRA_ENERGY_COST = 10
    ENERGY_WEIGHT = 11
    LOG_NEED = 12
    OWN_LOG_NEED = 13
    ABILITY = 14
    GAIN_PER_CONTRIBUTION = 15
    GAIN = 16
    IS_IDLE_PLACE = 17
    OWN_SUPPLY_RATIO = 18
    SUPPLY_RATIO = 19
    REACHABLE_SHARE = 20
    CONTRIBUTION_PER_ABILITY = 21


class AgentFeature(IntEnum):
    """Features of an agent at its own place."""

    ABILITY = 0
    SHORTFALL_PER_CONTRIBUTION = 1
    SHORTFALL_WITHOUT_PER_CONTRIBUTION = 2
    CONTRIBUTION_PER_NEED = 3
    DISTANCE = 4
    ENERGY_COST = 5
    REACHABLE_SHARE = 6
    SHORTFALL_PER_NEED = 7


class TaskFeature(IntEnum):
    """Features of a place; those from `LOWEST_COVERAGE` to `ENERGY_WEIGHT` are global."""

    SHORTFALL_PER_NEED = 0
    SHORTFALL = 1
    FINE_SHORTFALL_PER_NEED = 2
    LOG_NEED = 3
    MEAN_CONTRIBUTION = 4
    LOG_MEMBERS = 5
    IS_IDLE_PLACE = 6
    LOWEST_COVERAGE = 7
    TOTAL_SHORTFALL = 8
    NET_SURPLUS = 9
    ENERGY_WEIGHT = 10
    SUPPLY_RATIO = 11


PAIR_FEATURES = len(PairFeature)
AGENT_FEATURES = len(AgentFeature)
TASK_FEATURES = len(TaskFeature)
