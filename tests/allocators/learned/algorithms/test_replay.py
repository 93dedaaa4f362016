"""The replay buffer: its contents, dropped trajectories, and storing."""

import io

import pytest
import torch
from boards import layout

from alloc.allocators.learned.algorithms.replay import ReplayBuffer
from alloc.allocators.learned.network.actor_critic import ActorCritic, NetworkSize
from alloc.allocators.learned.play.trajectories import Trajectories, collect
from alloc.problems.generate import paper_like


@pytest.fixture(scope="module")
def trajectories() -> list[Trajectories]:
    """Five trajectories of three games each, of different lengths."""
    torch.manual_seed(0)
    network = ActorCritic(NetworkSize(8, 8, 2))
    board = layout(*(paper_like(6, 3, 26, seed) for seed in range(3)))
    return [collect(network, board, 2 + number, torch.Generator().manual_seed(number)) for number in range(5)]


def same(one: Trajectories, two: Trajectories) -> bool:
    """Whether two trajectories agree in every number."""

    def numbers(value: object) -> list[torch.Tensor]:
        return [value] if isinstance(value, torch.Tensor) else [x for v in vars(value).values() for x in numbers(v)]

    return all(torch.equal(a, b) for a, b in zip(numbers(one), numbers(two), strict=True))


def drawn(replay: ReplayBuffer, draws: int = 60) -> list[Trajectories]:
    """What turns up in many draws, each once."""
    generator = torch.Generator().manual_seed(0)
    return list({id(one): one for one in (replay.draw(generator) for _ in range(draws)) if one is not None}.values())


def test_empty_buffer_yields_nothing() -> None:
    """Nothing is drawn from an empty buffer."""
    assert ReplayBuffer(100).draw(torch.Generator()) is None
    assert len(ReplayBuffer(100)) == 0


def test_oldest_trajectories_are_dropped_first(trajectories: list[Trajectories]) -> None:
    """The number of states never exceeds the capacity, and the latest trajectories that fit are kept."""
    sizes = [one.evaluations for one in trajectories]
    replay = ReplayBuffer(sum(sizes[2:]))
    for number, one in enumerate(trajectories):
        replay.add(one)
        assert len(replay) <= replay.capacity
        if number < 2:
            assert len(replay) == sum(sizes[: number + 1])
    assert len(replay) == replay.capacity
    assert {id(one) for one in drawn(replay)} == {id(one) for one in trajectories[2:]}


def test_oversized_trajectories_are_not_kept(trajectories: list[Trajectories]) -> None:
    """A trajectory beyond the capacity is not kept, and a buffer without capacity keeps nothing."""
    for capacity in (0, trajectories[0].evaluations - 1):
        replay = ReplayBuffer(capacity)
        replay.add(trajectories[0])
        assert len(replay) == 0
        assert replay.draw(torch.Generator()) is None


def test_trajectories_are_drawn_uniformly(trajectories: list[Trajectories]) -> None:
    """In 3,000 draws each of five trajectories occurs 600 times, within four standard deviations."""
    replay, generator = ReplayBuffer(10_000), torch.Generator().manual_seed(2)
    for one in trajectories:
        replay.add(one)
    draws = [id(replay.draw(generator)) for _ in range(3_000)]
    assert all(abs(draws.count(id(one)) - 600) < 4 * (3_000 * 0.2 * 0.8) ** 0.5 for one in trajectories)


def test_round_trip_through_a_file(trajectories: list[Trajectories]) -> None:
    """Stored as tensors and read into another buffer, all numbers and further draws are the same."""
    replay, again, file = ReplayBuffer(10_000), ReplayBuffer(10_000), io.BytesIO()
    for one in trajectories:
        replay.add(one)
    torch.save(replay.state_dict(), file)
    file.seek(0)
    again.load_state_dict(torch.load(file, weights_only=True))
    assert len(again) == len(replay)
    first, second = (torch.Generator().manual_seed(5) for _ in range(2))
    for _ in range(8):
        one, two = replay.draw(first), again.draw(second)
        assert one is not None
        assert two is not None
        assert same(one, two)
