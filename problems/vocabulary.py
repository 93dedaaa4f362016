"""Enumerations and constants of the problem model that do not need numpy."""

from enum import StrEnum

IDLE = -1
"""The task index of an agent without a task."""

EUCLIDEAN, MANHATTAN, GEOGRAPHIC = METRICS = ("euclidean", "manhattan", "geographic")
"""Distance between two places: (1) of the paper, the sum over the axes, or along the surface of the earth."""


class Objective(StrEnum):
    """Objective, lexicographic in the order of its name, after the number of unserved tasks."""

    MAKESPAN = "makespan"
    MAKESPAN_ENERGY = "makespan-energy"
    MAKESPAN_MOVES = "makespan-moves"


OBJECTIVES = (Objective.MAKESPAN, Objective.MAKESPAN_ENERGY)
"""Objectives that methods implement; moves are modelled as energy, see `replanning`."""


class Distribution(StrEnum):
    """Distribution of abilities or workloads."""

    EQUAL = "equal"
    UNIFORM = "uniform"
    LOGNORMAL = "lognormal"
    PARETO = "pareto"
    DIRICHLET = "dirichlet"


class Sites(StrEnum):
    """Distribution of places in the world."""

    UNIFORM = "uniform"
    CLUSTERED = "clustered"


class Starts(StrEnum):
    """Where agents start."""

    TASKS = "tasks"
    OWN = "own"
    DEPOTS = "depots"
    UNKNOWN = "unknown"


class TurnRule(StrEnum):
    """Which agents move in a step of the game."""

    BIDDING = "bidding"
    SIMULTANEOUS = "simultaneous"


class Reward(StrEnum):
    """What the reward of the game measures."""

    MAKESPAN = "makespan"
    COVERAGE = "coverage"


class ModelFormat(StrEnum):
    """File format of an integer programme."""

    LP = "lp"
    MPS = "mps"


class ModelKind(StrEnum):
    """Variables of an integer programme: numbers of agents per class and task, or one per agent and task."""

    CLASS = "class"
    PLAIN = "plain"


class Knowledge(StrEnum):
    """What agents know in a mission: the true state, or what they have sensed and received."""

    FULL = "full"
    LOCAL = "local"


class ForeignFormat(StrEnum):
    """Third-party file formats that can be imported as missions."""

    CFSTP = "cfstp"
    SPACE = "space"
    LONDON = "london"
    NEW_BRUNSWICK = "new-brunswick"


class MissionFamily(StrEnum):
    """Family of generated missions, named after its main difficulty."""

    STEADY = "steady"
    WAVES = "waves"
    HOT_SPOTS = "hot-spots"
    FAILURES = "failures"
    RECHARGING = "recharging"
    GROWTH = "growth"
    DEADLINES = "deadlines"
    SILENCE = "silence"
    PAPER_1 = "paper-1"
    PAPER_2 = "paper-2"
    PAPER_3 = "paper-3"
    PAPER_4 = "paper-4"
