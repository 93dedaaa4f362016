"""Agent decisions per second: of each way to play the game, or of compiled loops, torch, and a GPU if present.

    python tests/benchmarks/throughput.py ways
    python tests/benchmarks/throughput.py devices --games 64 512 4096

All play the same instances in one run, like the paper's first scenario and, of the ways, like a small one as well.

`ways`: a decision is one agent choosing: all n of a step where they choose at once or, as in the prototype and in
training, each bid that is granted and each stop where they bid. Where agents bid, every step also weighs the n (m + 1)
bids of all agents; those are counted in the last column. Scores are random without a network: what is left is the game
alone.

`devices`: the same greedy games from the same beginnings to their end, by the network that ships. Loops and torch on
the CPU, which take as long per game whatever their number, play at most `MAX_GAMES_ON_CPU` games.
"""

import argparse
import os
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import partial

import numpy as np
import torch
from torch import Tensor, nn

from alloc.allocators import load
from alloc.allocators.learned.network.actor_critic import ActorCritic, Scores
from alloc.allocators.learned.play.action_sampling import sample_actions
from alloc.allocators.learned.play.batched_games import Games, play_games
from alloc.allocators.learned.play.rollout import play
from alloc.allocators.runtime.torch_state import torch_threads
from alloc.problems import Instance, paper_like
from alloc.problems.environments import SimultaneousEnv
from alloc.problems.game import PAPER, PLANNING, Board, Rules, TurnRule, make_board, reset, step

AT_ONCE = Rules(TurnRule.SIMULTANEOUS, returning=True)
SIZES = ((24, 6, 100), (100, 20, 400))
"""Agents, tasks, and total ability."""

INSTANCES, ROUNDS, SECONDS, MAX_GAMES_ON_CPU = 64, 40, 4.0, 512
CORES = len(os.sched_getaffinity(0))

Play = Callable[[], tuple[int, int]]
"""Plays for a while; returns decisions and bids compared."""


def lay_out(size: tuple[int, int, int], instances: int, weight: float) -> tuple[list[Instance], Board]:
    """Return instances like the paper's, and a game on each."""
    drawn = [paper_like(*size, seed) for seed in range(instances)]
    return drawn, make_board(drawn, [1.0] * instances, [weight] * instances, np.random.default_rng(0))


def batched(
    board: Board, rules: Rules, network: ActorCritic | None, steps: int, *, temperature: float = 1.0, again: bool = True
) -> tuple[int, int]:
    """Play games side by side, `again` once all have ended; without a network scores are random."""
    generator = torch.Generator().manual_seed(0)
    state, decisions, bids = reset(board), 0, 0
    batch, n, c = board.shape
    for _ in range(steps):
        if bool(state.done.all()):
            if not again:
                break
            state = reset(board)
        if network is None:
            scores = Scores(torch.randn(batch, n, c, generator=generator), torch.zeros(batch), torch.zeros(batch))
        else:
            scores = network(board, state)
        actions, slot = sample_actions(board, state, scores, rules, temperature, generator)
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


def fastest(games: dict[str, Play], rounds: int = 5) -> dict[str, tuple[float, float]]:
    """Return decisions and bids per second of each.

    They take turns, so that a busy spell of the machine meets all alike; the fastest round is the least disturbed.
    """

    def measure(game: Play) -> tuple[float, float]:
        begun, total = time.perf_counter(), np.zeros(2)
        while (spent := time.perf_counter() - begun) < SECONDS / rounds:
            total += game()
        return total[0] / spent, total[1] / spent

    for once in games.values():
        once()
    rates = [{name: measure(game) for name, game in games.items()} for _ in range(rounds)]
    return {name: max(rate[name] for rate in rates) for name in games}


@torch.no_grad()
def ways(counts: Sequence[int]) -> None:
    """Print the table of the ways to play, so many games side by side."""
    torch.set_num_threads(1)
    torch.manual_seed(0)
    network = ActorCritic()
    print(
        "| agents/tasks | game | decisions/s | relative to PettingZoo | relative to the prototype | bids compared/s |"
    )
    print("|---|---|--:|--:|--:|--:|")
    for size, count in ((size, count) for count in counts for size in SIZES):
        instances, board = lay_out(size, count, 0.5)
        prototype = Prototype(instances, 0)
        games: dict[str, Play] = {
            "PettingZoo loop, one game, random": lambda one=instances[0]: one_env(one, 0, 5),
            "prototype with its network": lambda one=prototype: one.play(4),
        }
        for name, rules, scored in (
            ("bidding with the network", PLANNING, network),
            ("bidding, one move per step, with the network", Rules(most_moves=1), network),
            ("bidding, random", PLANNING, None),
            ("simultaneous, with the network", AT_ONCE, network),
            ("simultaneous, random", AT_ONCE, None),
            ("the paper's game (flying), random", PAPER, None),
        ):
            games[name] = lambda b=board, r=rules, n=scored: batched(b, r, n, 8)
        rates = fastest(games)
        loop, sketch = (rate for rate, _ in list(rates.values())[:2])
        for name, (rate, bids) in rates.items():
            against = f"{rate / loop:.1f} | {rate / sketch:.1f}"
            print(f"| {size[0]}/{size[1]} | {name} | {rate:,.0f} | {against} | {bids:,.0f} |", flush=True)


@torch.no_grad()
def decisions(network: ActorCritic, board: Board) -> int:
    """Count the decisions in the games on a board, so many games at once as there are instances."""
    parts = torch.arange(len(board.energy_weight), device=board.energy_weight.device).split(INSTANCES)
    greedy = {"temperature": 0.0, "again": False}
    return sum(batched(board[rows], PLANNING, network, ROUNDS, **greedy)[0] for rows in parts)


def loops(network: ActorCritic, board: Board, threads: int) -> None:
    """Play in compiled loops, a share of the games in each thread."""

    def share(rows: np.ndarray) -> None:
        with torch_threads(1):
            part = board[torch.from_numpy(rows)]
            games = Games(np.arange(len(rows)), part.energy_weight.numpy().astype(float), part.start.numpy())
            play_games(network, part, games, rounds=ROUNDS)

    with ThreadPoolExecutor(threads) as pool:
        list(pool.map(share, np.array_split(np.arange(len(board.energy_weight)), threads)))


def by_torch(network: ActorCritic, board: Board, threads: int) -> None:
    """Play by torch, where network and board are."""
    with torch_threads(threads):
        play(network, board, steps=ROUNDS).slot.cpu()


def seconds(work: Callable[[], None], repeats: int = 3) -> float:
    """Return the least time that it takes: the first time is in vain, unless it is long already."""
    times: list[float] = []
    while len(times) <= repeats and sum(times) < SECONDS:
        begun = time.perf_counter()
        work()
        times.append(time.perf_counter() - begun)
    return min(times)


def devices(counts: Sequence[int]) -> None:
    """Print the table of devices, for so many games at once."""
    ways = [(f"{name}, {threads} threads", "cpu", way, threads) for threads in sorted({1, CORES})
            for name, way in (("compiled loops", loops), ("torch", by_torch))]  # fmt: skip
    if torch.cuda.is_available():
        ways.append((torch.cuda.get_device_name(), "cuda", by_torch, 1))
    where = ways[-1][1]
    network = {device: load("gappo", device=device).networks[0] for _, device, _, _ in ways}  # type: ignore[attr-defined]
    print("| games | by | seconds | decisions/s |\n|--:|---|--:|--:|")
    _, board = lay_out(SIZES[1], INSTANCES, 1.0)
    for games in counts:
        near = replace(board[torch.arange(games) % INSTANCES], energy_weight=torch.linspace(0.2, 3.0, games))
        boards = {"cpu": near, where: near.to(where)}
        count = decisions(network[where], boards[where])
        for name, device, way, threads in ways:
            if device == "cuda" or games <= MAX_GAMES_ON_CPU:
                spent = seconds(partial(way, network[device], boards[device], threads))
                print(f"| {games} | {name} | {spent:.3f} | {count / spent:,.0f} |", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=["ways", "devices"])
    parser.add_argument("--games", type=int, nargs="+", help="at once; 16, or 64, 512 and 4096 for devices")
    options = parser.parse_args()
    if options.what == "ways":
        ways(options.games or [16])
    else:
        devices(options.games or [64, 512, 4096])


if __name__ == "__main__":
    main()
