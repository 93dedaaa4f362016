"""Agent decisions per second of the game, batched or not, on the same instances in one run.

    python tests/benchmarks/game_throughput.py

A decision is one agent choosing: all n of a step where they choose at once or, as in the prototype and in training,
each bid that is granted and each stop where they bid. Where agents bid, every step also weighs the n (m + 1) bids of
all agents; those are counted in the last column. Scores are random without a network: what is left is the game alone.
"""

import argparse
import time
from collections.abc import Callable, Sequence

import numpy as np
import torch
from torch import Tensor, nn

from alloc.allocators.learned.network.actor_critic import ActorCritic, Scores
from alloc.allocators.learned.play.action_sampling import sample_actions
from alloc.problems import Instance, paper_like
from alloc.problems.environments import SimultaneousEnv
from alloc.problems.game import PAPER, PLANNING, Board, Rules, TurnRule, make_board, reset, step

AT_ONCE = Rules(TurnRule.SIMULTANEOUS, returning=True)

Play = Callable[[], tuple[int, int]]
"""Plays for a while; returns decisions and bids weighed."""


def batched(board: Board, rules: Rules, network: ActorCritic | None, seed: int, steps: int) -> tuple[int, int]:
    """Play all games on `board` side by side."""
    generator = torch.Generator().manual_seed(seed)
    state, decisions, bids = reset(board), 0, 0
    batch, n, c = board.shape
    for _ in range(steps):
        if bool(state.done.all()):
            state = reset(board)
        if network is None:
            scores = Scores(torch.randn(batch, n, c, generator=generator), torch.zeros(batch), torch.zeros(batch))
        else:
            scores = network(board, state)
        actions, slot = sample_actions(board, state, scores, rules, 1.0, generator)
        decisions += int((actions >= 0).sum())
        bids += int((~state.done).sum()) * n * c
        state = step(board, state, slot)
    return decisions, bids


def one_env(instance: Instance, seed: int, steps: int) -> tuple[int, int]:
    """Loop over the PettingZoo environment as its documentation shows: one game, random actions."""
    env = SimultaneousEnv([instance], max_steps=steps)
    seen, _ = env.reset(seed=seed)
    decisions = 0
    for number, agent in enumerate(env.agents):
        env.action_space(agent).seed(seed + number)
    for _ in range(steps):
        actions = {agent: env.action_space(agent).sample(seen[agent]["action_mask"]) for agent in env.agents}
        decisions += len(actions)
        seen, *_ = env.step(actions)
    return decisions, decisions * (instance.m + 1)


class Prototype:
    """The game as first sketched: one move a step in each of B games, all pairs looked at and scored anew."""

    def __init__(self, instances: Sequence[Instance], seed: int) -> None:
        torch.manual_seed(seed)
        self.ability, self.need, place = (
            torch.tensor(np.array([getattr(one, name) for one in instances]), dtype=torch.float32)
            for name in ("ability", "workload", "task_position")
        )
        self.task = torch.tensor(np.array([one.start_task for one in instances]))
        self.distance = torch.cdist(place, place)
        self.group = torch.zeros_like(self.need).scatter_add_(1, self.task, self.ability)
        self.body = nn.Sequential(nn.Linear(16, 48), nn.ReLU(), nn.Linear(48, 48), nn.ReLU())
        self.bid, self.stop = nn.Linear(48, 1), nn.Linear(96, 1)
        self.value = nn.Sequential(nn.Linear(96, 48), nn.ReLU(), nn.Linear(48, 1))

    def look(self) -> Tensor:
        """Sixteen figures of each pair, shape (B, n, m, 16)."""
        (_, n), m = self.ability.shape, self.need.shape[1]
        lack, ability = self.need - self.group, self.ability[:, :, None]
        own, there = lack.gather(1, self.task)[:, :, None].expand(-1, -1, m), lack[:, None].expand(-1, n, -1)
        own_need = self.need.gather(1, self.task)[:, :, None].expand(-1, -1, m)
        need, mean = self.need[:, None].expand(-1, n, -1), self.ability.mean(1)[:, None, None]
        gain = there.clamp(min=0) + own.clamp(min=0) - (there - ability).clamp(min=0) - (own + ability).clamp(min=0)
        columns = [
            there / ability / 3, ((there - ability) / ability).clamp(-1, 1), own / ability / 3,
            ((own + ability) / ability).clamp(-1, 1), there / need, (there - ability) / need, own / own_need,
            (own + ability) / own_need, self.distance.gather(1, self.task[..., None].expand(-1, -1, m)),
            need.log(), own_need.log(), (ability / mean).expand(-1, -1, m), gain / ability, gain / mean,
            (self.group / self.need).amin(1)[:, None, None].expand(-1, n, m),
            (lack.clamp(min=0).sum(1) / self.need.sum(1))[:, None, None].expand(-1, n, m),
        ]  # fmt: skip
        return torch.stack(columns, -1).clamp(-2, 2)

    def play(self, steps: int) -> tuple[int, int]:
        """Draw one bid per game and step, and weigh what it brings; games that stop go on, in favour of the sketch."""
        (batch, n), m = self.ability.shape, self.need.shape[1]
        rows = torch.arange(batch)
        for _ in range(steps):
            seen = self.body(self.look().flatten(1, 2))
            pooled = torch.cat([seen.mean(1), seen.amax(1)], -1)
            stay = nn.functional.one_hot(self.task, m).bool().flatten(1)
            logits = torch.cat([self.bid(seen)[..., 0].masked_fill(stay, -1e9), self.stop(pooled)], 1)
            self.value(pooled)
            action = torch.distributions.Categorical(logits=logits).sample().clamp(max=n * m - 1)
            agent, goal = action // m, action % m
            self.group[rows, self.task[rows, agent]] -= self.ability[rows, agent]
            self.group[rows, goal] += self.ability[rows, agent]
            self.task[rows, agent] = goal
        return batch * steps, batch * steps * n * m


def measure(play: Play, seconds: float) -> tuple[float, float]:
    """Repeat until `seconds` are over; return decisions and bids per second."""
    begun, decisions, bids = time.perf_counter(), 0, 0
    while (spent := time.perf_counter() - begun) < seconds:
        more = play()
        decisions, bids = decisions + more[0], bids + more[1]
    return decisions / spent, bids / spent


def best_of_rounds(games: dict[str, Play], seconds: float, rounds: int = 5) -> dict[str, tuple[float, float]]:
    """Take turns, so that a busy spell of the machine meets all alike; the fastest round is the least disturbed."""
    for play in games.values():
        play()
    rates = [{name: measure(play, seconds / rounds) for name, play in games.items()} for _ in range(rounds)]
    return {name: max(rate[name] for rate in rates) for name in games}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--games", type=int, default=16)
    parser.add_argument("--seconds", type=float, default=4.0, help="of each measurement")
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    torch.set_num_threads(1)
    torch.manual_seed(options.seed)
    network, seed = ActorCritic(), options.seed
    print("| agents/tasks | game | decisions/s | against PettingZoo | against the prototype | bids weighed/s |")
    print("|---|---|--:|--:|--:|--:|")
    for n, m, total in ((24, 6, 100), (100, 20, 400)):
        instances = [paper_like(n, m, total, seed + number) for number in range(options.games)]
        board = make_board(instances, [1.0] * options.games, [0.5] * options.games, np.random.default_rng(seed))
        prototype = Prototype(instances, seed)
        games: dict[str, Play] = {
            "PettingZoo loop, one game, random": lambda one=instances[0]: one_env(one, seed, 5),
            "prototype with its network": lambda one=prototype: one.play(4),
            "bidding with the network": lambda b=board: batched(b, PLANNING, network, seed, 8),
            "bidding, one move a step, with the network": lambda b=board: batched(
                b, Rules(most_moves=1), network, seed, 8
            ),
            "bidding, random": lambda b=board: batched(b, PLANNING, None, seed, 8),
            "at once with the network": lambda b=board: batched(b, AT_ONCE, network, seed, 8),
            "at once, random": lambda b=board: batched(b, AT_ONCE, None, seed, 8),
            "the paper's game (flying), random": lambda b=board: batched(b, PAPER, None, seed, 8),
        }
        with torch.no_grad():
            rates = best_of_rounds(games, options.seconds)
        loop, sketch = (rate for rate, _ in list(rates.values())[:2])
        for name, (rate, bids) in rates.items():
            print(f"| {n}/{m} | {name} | {rate:,.0f} | {rate / loop:.1f} | {rate / sketch:.1f} | {bids:,.0f} |")


if __name__ == "__main__":
    main()
