"""``alloc train --missions``."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, TypedDict

import typer

from alloc.problems.vocabulary import Reward, TurnRule

if TYPE_CHECKING:
    from alloc.allocators.parallel.engine import Engine
    from alloc.cli.commands.training.train import Progress


class Shared(TypedDict):
    """Arguments common to training on instances and on missions."""

    steps: int | None
    minutes: float | None
    iterations: int | None
    patience: int | None
    init: str | None
    population: int | None
    parameters: Mapping[str, object]
    seed: int
    resume: bool
    checkpoint: str
    log: str
    tensorboard: str | None
    engine: "Engine"


def check_no_games(family: list[str] | None, instances: str | None, turn: TurnRule, reward: Reward) -> None:
    """Raise a usage error for options that do not apply to missions."""
    given = {
        "--family": family is not None,
        "--instances": instances is not None,
        "--turn": turn != TurnRule.BIDDING,
        "--reward": reward != Reward.MAKESPAN,
    }
    for name, is_given in given.items():
        if is_given:
            raise typer.BadParameter("cannot be used with --missions", param_hint=f"'{name}'")


def train_in_missions(
    method: str, output: str, names: list[str], decisions: int | None, shared: Shared, progress: "Progress"
) -> None:
    """Train on families of missions, or on mission files if the names are files."""
    from alloc.allocators.learned.missions.training.run import train_on_missions
    from alloc.problems import read_mission

    files = [name for name in names if name.endswith(".json")]
    train_on_missions(
        method,
        output,
        families=[name for name in names if name not in files] or ["mixed"],
        missions=[read_mission(name) for name in files],
        decisions=decisions or 60_000,
        on_start=progress.start,
        on_report=progress.tell,
        **shared,
    )
