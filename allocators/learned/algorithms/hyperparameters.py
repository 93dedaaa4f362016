"""Hyperparameters of the learning methods, checked where they are set; knows nothing of torch."""

from dataclasses import dataclass

from alloc.allocators.learned.algorithms.hyperparameter_ranges import COUNT, check_ranges


@dataclass(frozen=True)
class PpoParameters:
    """Hyperparameters of PPO; the paper leaves all of them open, so these are ours.

    Attributes
    ----------
    learning_rate : float
        First step size.
    final_share : float
        The most that the step size may be at the end, as a share of `highest_rate`; falls linearly with progress.
    highest_rate : float
        The most that the step size may grow to.
    kl_target : float or None
        Divergence per update at which the step size stays as it is; None for a step size that only falls.
    discount, smoothing : float
        gamma and lambda of (9).
    clip : float
        epsilon of (13).
    entropy_weight, value_weight : float
        Weights of the entropy bonus and of (15).
    reward_scale : float
        Factor on rewards, which are fractions of 1 by nature.
    epochs, minibatch : int
        Passes over the trajectories of an update, and states per gradient step.
    max_gradient_norm : float
        Where gradients are clipped.
    capacity : int
        States that the replay buffer holds, C; 0 for learning from fresh games only.
    """

    learning_rate: float = 1e-3
    final_share: float = 0.05
    highest_rate: float = 3e-3
    kl_target: float | None = None
    discount: float = 0.99
    smoothing: float = 0.95
    clip: float = 0.2
    entropy_weight: float = 0.003
    value_weight: float = 0.5
    reward_scale: float = 20.0
    epochs: int = 3
    minibatch: int = 128
    max_gradient_norm: float = 0.5
    capacity: int = 0

    def __post_init__(self) -> None:
        check_ranges(self)


@dataclass(frozen=True)
class GappoParameters(PpoParameters):
    """What a member of the population adds to plain PPO: a step size by the divergence, and a replay buffer."""

    kl_target: float | None = 0.012
    capacity: int = 10_000


@dataclass(frozen=True)
class A2cParameters:
    """Hyperparameters of A2C.

    Rounded from one of five short trials with one seed each, too few to tell one from the next; in twelve longer ones
    (`tests/benchmarks/from_scratch_tuning.py`) none did better.

    Attributes
    ----------
    learning_rate : float
        First step size of Adam.
    final_share : float
        Step size at the end of the training, as a share of the first; it falls linearly with progress.
    steps : int
        Steps of every game that are played before each gradient step, n.
    discount : float
        gamma, per step.
    entropy_weight, value_weight : float
        Weights of the entropy bonus and of the critic's loss.
    reward_scale : float
        Factor on rewards, which are fractions of 1 by nature.
    max_gradient_norm : float
        Where gradients are clipped.
    """

    learning_rate: float = 1.1e-3
    final_share: float = 0.1
    steps: int = 2
    discount: float = 0.97
    entropy_weight: float = 0.024
    value_weight: float = 0.5
    reward_scale: float = 20.0
    max_gradient_norm: float = 0.5

    def __post_init__(self) -> None:
        check_ranges(self)


@dataclass(frozen=True)
class DqnParameters:
    """Hyperparameters of DQN.

    Rounded from the best of four short trials with one seed each, too few to tell one from the next; others that did a
    little better in small games: `tests/benchmarks/from_scratch_tuned.json`.

    Attributes
    ----------
    learning_rate : float
        First step size of Adam.
    final_share : float
        Step size at the end of the training, as a share of the first; it falls linearly with progress.
    discount : float
        gamma of (17), per move.
    reward_scale : float
        Factor on rewards, which are fractions of 1 by nature.
    temperature, final_temperature : float
        Of the softmax over Q by which bids are drawn, at the beginning and at the end; it falls exponentially.
    exploring : float
        Share of the rounds that begin with a bid at random; falls linearly to 0.
    capacity : int
        Moves that the memory holds, C.
    minibatch : int
        Moves per gradient step.
    reuse : float
        How often each move is learned from, on average.
    target_period : int
        Gradient steps after which the target network is set to the one that learns.
    double : bool
        Whether the network that learns picks the move that the target network values.
    max_gradient_norm : float
        Where gradients are clipped.
    """

    learning_rate: float = 7e-4
    final_share: float = 0.1
    discount: float = 0.5
    reward_scale: float = 5.0
    temperature: float = 0.2
    final_temperature: float = 0.02
    exploring: float = 0.05
    capacity: int = 10_000
    minibatch: int = 64
    reuse: float = 1.0
    target_period: int = 300
    double: bool = True
    max_gradient_norm: float = 10.0

    def __post_init__(self) -> None:
        check_ranges(self, capacity=COUNT)


@dataclass(frozen=True)
class DdpgParameters:
    """Hyperparameters of DDPG.

    Rounded from the third of four short trials with one seed each, as the two ahead of it evaluate twice as many states
    per decision; others that did a little better in small games: `tests/benchmarks/from_scratch_tuned.json`.

    Attributes
    ----------
    learning_rate : float
        First step size of Adam, for the critic.
    actor_share : float
        Step size of the actor, as a share of the critic's.
    final_share : float
        Step sizes at the end of the training, as a share of the first; they fall linearly with progress.
    discount : float
        gamma, per move.
    reward_scale : float
        Factor on rewards, which are fractions of 1 by nature.
    softness : float
        Temperature of the softmax that gives the shares, and of the draws.
    entropy_weight, final_entropy_weight : float
        Of the bonus on the entropy of the shares, at the beginning and at the end; it falls exponentially. Where it
        begins at 0, there is none.
    exploring : float
        Share of the rounds that begin with a bid at random; falls linearly to 0.
    capacity : int
        Moves that the memory holds, C.
    minibatch : int
        Moves per gradient step.
    reuse : float
        How often each move is learned from, on average.
    target_share : float
        How far the target networks follow with each gradient step, 0 to 1 (Polyak).
    max_gradient_norm : float
        Where gradients are clipped.
    """

    learning_rate: float = 5e-4
    actor_share: float = 1.0
    final_share: float = 0.1
    discount: float = 0.5
    reward_scale: float = 5.0
    softness: float = 1.0
    entropy_weight: float = 0.07
    final_entropy_weight: float = 0.01
    exploring: float = 0.2
    capacity: int = 10_000
    minibatch: int = 32
    reuse: float = 1.0
    target_share: float = 0.005
    max_gradient_norm: float = 10.0

    def __post_init__(self) -> None:
        check_ranges(self, capacity=COUNT)


@dataclass(frozen=True)
class BreedingParameters:
    """How a generation follows from the last.

    Attributes
    ----------
    elite : int
        Members that pass unchanged; one less than there are, at the most.
    tournament : int
        Members that compete to be a parent.
    crossover_probability : float
        Chance that a child blends the weights of two parents.
    mutation_probability : float
        Chance that a child's weights are disturbed.
    mutated_share : float
        Share of the weights that a mutation disturbs.
    mutation_size : float
        Standard deviation of the disturbance.
    return_weight, entropy_weight, cost_weight : float
        alpha, beta and gamma of (12).
    """

    elite: int = 2
    tournament: int = 2
    crossover_probability: float = 0.3
    mutation_probability: float = 0.5
    mutated_share: float = 0.1
    mutation_size: float = 0.01
    return_weight: float = 1.0
    entropy_weight: float = 0.005
    cost_weight: float = 0.005

    def __post_init__(self) -> None:
        check_ranges(self)
