"""Hyperparameters of the learning methods, checked when they are set; does not import torch.

Names follow CleanRL and Stable-Baselines3. Of their values, the paper gives only the capacity C; the defaults are ours.
"""

from dataclasses import dataclass

from alloc.allocators.learned.algorithms.hyperparameter_ranges import COUNT, check_ranges


@dataclass(frozen=True)
class PpoParameters:
    """Hyperparameters of PPO.

    Attributes
    ----------
    learning_rate : float
        Initial learning rate of Adam.
    final_lr_fraction : float
        Upper bound of the learning rate at the end of the training, as a fraction of `max_learning_rate`; the bound
        decreases linearly with progress.
    max_learning_rate : float
        Upper bound of the learning rate at the beginning.
    target_kl : float or None
        Target divergence per update, in nats, for adapting the learning rate; if None, the rate only follows its bound.
    gamma : float
        Discount per step, gamma of (9).
    gae_lambda : float
        Lambda of (9), generalised advantage estimation.
    clip_coef : float
        Epsilon of (13).
    ent_coef, vf_coef : float
        Coefficients of the entropy bonus and of the value loss (15).
    reward_scale : float
        Factor on rewards, which are fractions of 1.
    update_epochs : int
        Passes over the trajectories of an update.
    minibatch_size : int
        States per gradient step.
    max_grad_norm : float
        Norm to which gradients are clipped.
    buffer_size : int
        Capacity C of the replay buffer in states; 0 to learn from new games only.
    replay_draws : int
        Trajectories of the replay buffer that each update draws.
    """

    learning_rate: float = 1e-3
    final_lr_fraction: float = 0.05
    max_learning_rate: float = 3e-3
    target_kl: float | None = None
    gamma: float = 0.99
    gae_lambda: float = 0.95
    clip_coef: float = 0.2
    ent_coef: float = 0.003
    vf_coef: float = 0.5
    reward_scale: float = 20.0
    update_epochs: int = 3
    minibatch_size: int = 128
    max_grad_norm: float = 0.5
    buffer_size: int = 0
    replay_draws: int = 1

    def __post_init__(self) -> None:
        check_ranges(self)


@dataclass(frozen=True)
class GappoParameters(PpoParameters):
    """Hyperparameters of GAPPO's members: PPO with an adaptive learning rate, a replay buffer and optional genes.

    Attributes
    ----------
    genes : int
        Number of members that share one network except for its biases (`genes.Genes`); 1 for a separate network.
    gene_sigma : float
        Standard deviation of the initial differences between their biases, and of mutations.
    breeding_interval : int
        Number of updates between two generations of genes; 0 for genes that are not bred.
    """

    target_kl: float | None = 0.012
    buffer_size: int = 10_000
    genes: int = 1
    gene_sigma: float = 0.03
    breeding_interval: int = 30


@dataclass(frozen=True)
class A2cParameters:
    """Hyperparameters of A2C.

    Rounded from one of five short trials with one seed each, which are too few to distinguish them; in twelve longer
    trials (`allocators/experiments/reproduction/protocol.py`) none was better.

    Attributes
    ----------
    learning_rate : float
        Initial learning rate of Adam.
    final_lr_fraction : float
        Learning rate at the end of the training, as a fraction of the first; it falls linearly with progress.
    num_steps : int
        Steps of every game before each gradient step, n.
    gamma : float
        Discount per step.
    ent_coef, vf_coef : float
        Coefficients of the entropy bonus and of the value loss.
    reward_scale : float
        Factor on rewards, which are fractions of 1.
    max_grad_norm : float
        Norm to which gradients are clipped.
    """

    learning_rate: float = 1.1e-3
    final_lr_fraction: float = 0.1
    num_steps: int = 2
    gamma: float = 0.97
    ent_coef: float = 0.024
    vf_coef: float = 0.5
    reward_scale: float = 20.0
    max_grad_norm: float = 0.5

    def __post_init__(self) -> None:
        check_ranges(self)


@dataclass(frozen=True)
class DqnParameters:
    """Hyperparameters of DQN.

    Rounded from the best of four short trials with one seed each, which are too few to distinguish them; for others
    that were slightly better in small games, see `allocators/experiments/reproduction/protocol.py:TUNED`.

    Attributes
    ----------
    learning_rate : float
        Initial learning rate of Adam.
    final_lr_fraction : float
        Learning rate at the end of the training, as a fraction of the first; it falls linearly with progress.
    gamma : float
        Discount per move, gamma of (17).
    reward_scale : float
        Factor on rewards, which are fractions of 1.
    temperature, final_temperature : float
        Initial and final temperature of the softmax over Q from which bids are sampled; it decreases exponentially.
    exploration_initial_eps : float
        Initial probability that a step begins with a random bid; it falls linearly to 0.
    buffer_size : int
        Capacity C of the replay memory in moves.
    batch_size : int
        Moves per gradient step.
    replay_ratio : float
        Number of times that each move is replayed, on average.
    target_update_interval : int
        Gradient steps between two updates of the target network.
    double_q : bool
        Double Q-learning: the online network selects the move that the target network values.
    max_grad_norm : float
        Norm to which gradients are clipped.
    """

    learning_rate: float = 7e-4
    final_lr_fraction: float = 0.1
    gamma: float = 0.5
    reward_scale: float = 5.0
    temperature: float = 0.2
    final_temperature: float = 0.02
    exploration_initial_eps: float = 0.05
    buffer_size: int = 10_000
    batch_size: int = 64
    replay_ratio: float = 1.0
    target_update_interval: int = 300
    double_q: bool = True
    max_grad_norm: float = 10.0

    def __post_init__(self) -> None:
        check_ranges(self, buffer_size=COUNT)


@dataclass(frozen=True)
class DdpgParameters:
    """Hyperparameters of DDPG.

    Rounded from the third best of four short trials with one seed each, as the two better ones evaluate twice as many
    states per decision; for others that were slightly better in small games, see
    `allocators/experiments/reproduction/protocol.py:TUNED`.

    Attributes
    ----------
    learning_rate : float
        Initial learning rate of Adam for the critic.
    actor_lr_fraction : float
        Learning rate of the actor, as a fraction of the critic's.
    final_lr_fraction : float
        Learning rates at the end of the training, as a fraction of the first; they fall linearly with progress.
    gamma : float
        Discount per move.
    reward_scale : float
        Factor on rewards, which are fractions of 1.
    softmax_temperature : float
        Temperature of the softmax that relaxes the action, and of sampling.
    ent_coef, final_ent_coef : float
        Initial and final coefficient of the entropy bonus; it decreases exponentially, or stays at 0 if it begins at 0.
    exploration_initial_eps : float
        Initial probability that a step begins with a random bid; it falls linearly to 0.
    buffer_size : int
        Capacity C of the replay memory in moves.
    batch_size : int
        Moves per gradient step.
    replay_ratio : float
        Number of times that each move is replayed, on average.
    tau : float
        Polyak factor of the target networks, 0 to 1: the fraction by which they approach the online networks in each
        gradient step.
    max_grad_norm : float
        Norm to which gradients are clipped.
    """

    learning_rate: float = 5e-4
    actor_lr_fraction: float = 1.0
    final_lr_fraction: float = 0.1
    gamma: float = 0.5
    reward_scale: float = 5.0
    softmax_temperature: float = 1.0
    ent_coef: float = 0.07
    final_ent_coef: float = 0.01
    exploration_initial_eps: float = 0.2
    buffer_size: int = 10_000
    batch_size: int = 32
    replay_ratio: float = 1.0
    tau: float = 0.005
    max_grad_norm: float = 10.0

    def __post_init__(self) -> None:
        check_ranges(self, buffer_size=COUNT)


@dataclass(frozen=True)
class BreedingParameters:
    """Parameters of the genetic algorithm over the population.

    Attributes
    ----------
    elite : int
        Number of members that are kept unchanged; at most all except one.
    tournament_size : int
        Members drawn for each tournament selection of a parent.
    crossover_probability : float
        Probability that a child blends the weights of two parents.
    mutation_probability : float
        Probability that a child is mutated.
    mutated_fraction : float
        Probability that a weight changes in a mutation.
    mutation_sigma : float
        Standard deviation of the change of a weight.
    return_weight, entropy_weight, cost_weight : float
        Alpha, beta and gamma of (12).
    """

    elite: int = 2
    tournament_size: int = 2
    crossover_probability: float = 0.3
    mutation_probability: float = 0.5
    mutated_fraction: float = 0.1
    mutation_sigma: float = 0.01
    return_weight: float = 1.0
    entropy_weight: float = 0.005
    cost_weight: float = 0.005

    def __post_init__(self) -> None:
        check_ranges(self)


Hyperparameters = PpoParameters | A2cParameters | DqnParameters | DdpgParameters
"""Hyperparameters of any method."""
