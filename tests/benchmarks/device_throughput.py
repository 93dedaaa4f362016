"""Decisions of agents per second in many games at once: compiled loops, torch on the CPU, and torch on a GPU if any.

    python tests/benchmarks/device_throughput.py --games 64 512 4096

All play the same greedy games, by the network that ships, on instances like the paper's first scenario, from the same
beginnings to their end. A decision is a bid that is granted, or the stop at the end of a game; they are counted once.
Loops and torch on the CPU, which take as long per game whatever their number, play at most --most-here games.
"""

import argparse
import os
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import torch

from alloc.allocators import load
from alloc.allocators.learned.network.actor_critic import ActorCritic
from alloc.allocators.learned.play.action_sampling import choose
from alloc.allocators.learned.play.batched_games import Games, play_games
from alloc.allocators.learned.play.rollout import play
from alloc.allocators.runtime.torch_state import torch_threads
from alloc.problems import paper_like
from alloc.problems.game import Board, begin, make_board, step

INSTANCES = 64
ROUNDS = 40
ENOUGH_S = 3.0
CORES = len(os.sched_getaffinity(0))


def lay_out(n: int, m: int, total: int, games: int) -> Board:
    """Return games on `INSTANCES` instances at many prices."""
    instances = [paper_like(n, m, total, seed) for seed in range(INSTANCES)]
    board = make_board(instances, [1.0] * INSTANCES, [1.0] * INSTANCES, np.random.default_rng(0))
    price = torch.linspace(0.2, 3.0, games)
    return replace(board[torch.arange(games) % INSTANCES], price=price)


@torch.no_grad()
def decisions(network: ActorCritic, board: Board) -> int:
    """Count the decisions in the games on a board, so many games at once as there are instances."""
    count = 0
    for rows in torch.arange(len(board.price), device=board.price.device).split(INSTANCES):
        part = board[rows]
        state = begin(part)
        for _ in range(ROUNDS):
            if bool(state.done.all()):
                break
            actions, slot = choose(part, state, network(part, state))
            count += int((actions >= 0).sum())
            state = step(part, state, slot)
    return count


def loops(network: ActorCritic, board: Board, threads: int) -> None:
    """Play in compiled loops, a share of the games in each thread."""

    def share(rows: np.ndarray) -> None:
        with torch_threads(1):
            part = board[torch.from_numpy(rows)]
            games = Games(np.arange(len(rows)), part.price.numpy().astype(float), part.start.numpy())
            play_games(network, part, games, rounds=ROUNDS)

    with ThreadPoolExecutor(threads) as pool:
        list(pool.map(share, np.array_split(np.arange(len(board.price)), threads)))


def by_torch(network: ActorCritic, board: Board, threads: int) -> None:
    """Play by torch, where network and board are."""
    with torch_threads(threads):
        play(network, board, steps=ROUNDS).slot.cpu()


def seconds(work: Callable[[], None], repeats: int = 3) -> float:
    """Return the least time that it takes: the first time is in vain, unless it is long already."""
    times: list[float] = []
    while len(times) <= repeats and sum(times) < ENOUGH_S:
        begun = time.perf_counter()
        work()
        times.append(time.perf_counter() - begun)
    return min(times)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--games", type=int, nargs="+", default=[64, 512, 4096])
    parser.add_argument("--size", type=int, nargs=3, default=[100, 20, 400], help="agents, tasks, total ability")
    parser.add_argument("--most-here", type=int, default=512, help="games on the CPU")
    options = parser.parse_args()
    network = load("gappo").networks[0]  # type: ignore[attr-defined]
    ways: dict[str, Callable[[Board], None]] = {}
    for threads in sorted({1, CORES}):
        ways[f"compiled loops, {threads} threads"] = lambda board, t=threads: loops(network, board, t)
        ways[f"torch, {threads} threads"] = lambda board, t=threads: by_torch(network, board, t)
    where, far = "cpu", network
    if torch.cuda.is_available():
        where, far = "cuda", load("gappo", device="cuda").networks[0]  # type: ignore[attr-defined]
        ways[torch.cuda.get_device_name()] = lambda board: by_torch(far, board, 1)
    print("| games | by | seconds | decisions/s |")
    print("|--:|---|--:|--:|")
    for games in options.games:
        board = lay_out(*options.size, games)
        there = board.to(where)
        count = decisions(far, there)
        for name, way in ways.items():
            away = name.startswith(("compiled", "torch"))
            if away and games > options.most_here:
                continue
            spent = seconds(lambda way=way, board=board if away else there: way(board))
            print(f"| {games} | {name} | {spent:.3f} | {count / spent:,.0f} |", flush=True)


if __name__ == "__main__":
    main()
