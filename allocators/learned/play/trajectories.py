"""Trajectories for learning, and the advantages of their actions."""

from dataclasses import dataclass, fields

import torch
from torch import Tensor

from alloc.allocators.learned.network.actor_critic import ActorCritic
from alloc.allocators.learned.play.action_sampling import log_probabilities, sample_actions
from alloc.problems.game import (
    PLANNING,
    Board,
    Rules,
    State,
    reset,
    step,
    utility,
)


@dataclass(frozen=True, eq=False)
class Trajectories:
    """Trajectories of B games over S steps, with at most k moves per step.

    Attributes
    ----------
    board : Board
    state : State
        States before each step; the shapes of all arrays begin with (S, B).
    actions : Tensor of int, shape (S, B, k)
        As `sample_actions` returns them, padded with -1.
    log_probability : Tensor, shape (S, B, k)
        Log-probability of each action under the behaviour policy.
    value, reward : Tensor, shape (S, B)
        Value of the state before the step, and increase of the utility.
    last_value : Tensor, shape (B,)
        Value of the state after the last step, 0 in games that have ended; truncated games have not.
    """

    board: Board
    state: State
    actions: Tensor
    log_probability: Tensor
    value: Tensor
    reward: Tensor
    last_value: Tensor

    @property
    def alive(self) -> Tensor:
        """Whether each game was still running before each step, shape (S, B)."""
        return ~self.state.done

    @property
    def decisions(self) -> int:
        """Number of decisions of agents, including those to stop."""
        return int((self.actions >= 0).sum())

    @property
    def evaluations(self) -> int:
        """Number of states that the network evaluated."""
        return int(self.alive.sum())


@torch.no_grad()
def collect(
    network: ActorCritic,
    board: Board,
    steps: int,
    generator: torch.Generator,
    rules: Rules = PLANNING,
    reward_scale: float = 1.0,
    state: State | None = None,
) -> Trajectories:
    """Play up to `steps` steps of every game on `board`, from `state` if given, with actions drawn from the policy."""
    state = reset(board) if state is None else state
    before = utility(board, state, rules)
    columns: list[tuple[State, Tensor, Tensor, Tensor, Tensor]] = []
    for _ in range(steps):
        if bool(state.done.all()):
            break
        scores = network(board, state)
        actions, slot = sample_actions(board, state, scores, rules, 1.0, generator)
        log_probability, _ = log_probabilities(board, state, scores, actions, rules)
        after = step(board, state, slot)
        now = utility(board, after, rules)
        alive = ~state.done
        reward = reward_scale * (now - before)
        columns.append((state, actions, log_probability, scores.value * alive, reward * alive))
        state, before = after, now
    last = network(board, state).value.masked_fill(state.done, 0.0)
    states, actions_, log_probabilities_, values, rewards = zip(*columns, strict=True)
    stacked = State(*(torch.stack([getattr(one, field.name) for one in states]) for field in fields(State)))
    moves = max(one.shape[1] for one in actions_)
    return Trajectories(
        board,
        stacked,
        _padded(actions_, moves, -1),
        _padded(log_probabilities_, moves, 0.0),
        torch.stack(values),
        torch.stack(rewards),
        last,
    )


def _padded(columns: tuple[Tensor, ...], width: int, value: float) -> Tensor:
    return torch.stack([torch.nn.functional.pad(one, (0, width - one.shape[1]), value=value) for one in columns])


def advantages(
    reward: Tensor,
    value: Tensor,
    alive: Tensor,
    last_value: Tensor,
    discount: float,
    gae_lambda: float,
    importance_ratio: Tensor | None = None,
) -> Tensor:
    """Return the advantages by generalised advantage estimation, (9) and (10), shape (S, B).

    Parameters
    ----------
    reward, value : Tensor, shape (S, B)
    alive : Tensor of bool, shape (S, B)
        Whether the game was still running before each step.
    last_value : Tensor, shape (B,)
        Value after the last step, 0 if the game is over.
    importance_ratio : Tensor, shape (S, B), optional
        Probability ratio of each step under the learning policy to the behaviour policy; ratios below 1 cut the trace,
        as in V-trace (Espeholt et al. 2018, arXiv:1802.01561). 1 by default.
    """
    result = torch.zeros_like(reward)
    following, later = last_value, torch.zeros_like(last_value)
    trace = torch.ones_like(reward) if importance_ratio is None else importance_ratio.clamp(max=1.0)
    for t in reversed(range(len(reward))):
        error = reward[t] + discount * following - value[t]
        result[t] = (error + discount * gae_lambda * later) * alive[t]
        later = trace[t] * result[t]
        following = value[t] * alive[t]
    return result
