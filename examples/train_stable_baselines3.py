"""Train PPO of Stable-Baselines3 on a tiny instance, and compare its plan with random, greedy and optimal ones.

Run ``python examples/train_stable_baselines3.py`` after ``pip install 'alloc-mrta[env]' stable-baselines3``.
For action masks, replace PPO by MaskablePPO of sb3-contrib, which calls `BiddingEnv.action_masks`.
"""

import argparse

import numpy as np
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.env_util import make_vec_env

from alloc.allocators import solve
from alloc.problems import Allocation, Instance, evaluate, paper_like
from alloc.problems.environments import BiddingEnv


def train(problem: Instance, steps: int, seed: int) -> PPO:
    """Train on four parallel games; PPO does not support masks, so that illegal bids have a small penalty."""
    games = make_vec_env(lambda: BiddingEnv([problem], illegal_reward=-0.05), n_envs=4, seed=seed)
    model = PPO("MlpPolicy", games, n_steps=128, batch_size=128, learning_rate=1e-3, seed=seed, device="cpu")
    return model.learn(steps)


def plan_of(model: PPO, problem: Instance) -> dict[str, float]:
    """Play one deterministic game, and return the scores of its plan; an illegal bid ends the game."""
    game, over, info = BiddingEnv([problem]), False, {}
    seen, _ = game.reset(seed=0)
    while not over:
        action, _ = model.predict(seen, deterministic=True)
        action = action if game.action_masks()[action] else game.action_space.n - 1
        seen, _, ended, cut, info = game.step(action)
        over = ended or cut
    return info


def random_makespan(problem: Instance, seed: int) -> float:
    """Return the mean makespan of random plans that serve every task."""
    rng = np.random.default_rng(seed)
    plans = [evaluate(problem, Allocation(rng.integers(0, problem.m, problem.n))) for _ in range(1000)]
    return float(np.mean([plan.makespan for plan in plans if plan.makespan is not None]))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--steps", type=int, default=8000)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    torch.set_num_threads(1)
    problem = paper_like(agents=6, tasks=3, total=24, seed=5)
    learned = plan_of(train(problem, options.steps, options.seed), problem)
    assert learned["unserved"] == 0
    print(f"random   T = {random_makespan(problem, options.seed):.3f} h")
    print(f"greedy   T = {solve(problem, 'greedy').makespan:.3f} h")
    print(f"learned  T = {learned['makespan']:.3f} h, energy {learned['energy']:.1f}")
    optimal = solve(problem, "cpsat", objective="makespan-energy", threads=1)
    print(f"optimal  T = {optimal.makespan:.3f} h, energy {optimal.energy:.1f}")


if __name__ == "__main__":
    main()
