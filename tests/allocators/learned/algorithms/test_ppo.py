"""PPO: formulas match hand calculation, and gradient steps the loss written out.

That it learns what has a known answer is shown in `test_probes`.
"""

import pytest
import torch
from boards import layout
from probes import best_utility, probe
from resuming import assert_resumes_elsewhere, weights

from alloc.allocators.learned.algorithms.hyperparameters import GappoParameters, PpoParameters
from alloc.allocators.learned.algorithms.learner import TrainingJob
from alloc.allocators.learned.algorithms.ppo import (
    MIN_LEARNING_RATE,
    Ppo,
    adapted_learning_rate,
    clipped_surrogate,
    off_policy_samples,
    on_policy_samples,
    value_loss,
)
from alloc.allocators.learned.network.actor_critic import ActorCritic, NetworkSize
from alloc.allocators.learned.play.action_sampling import log_probabilities
from alloc.allocators.learned.play.trajectories import Trajectories, collect
from alloc.problems import Instance
from alloc.problems.game import PLANNING, Board, Rules, TurnRule, reset, utility
from alloc.problems.generate import paper_like

SMALL = NetworkSize(8, 8, 2)
AT_ONCE = Rules(turn=TurnRule.SIMULTANEOUS)
both_turns = pytest.mark.parametrize("rules", [PLANNING, AT_ONCE], ids=["bidding", "at once"])


@pytest.fixture
def board() -> Board:
    return layout(*(paper_like(8, 3, 36, seed) for seed in range(6)))


def played(learner: Ppo, board: Board, rules: Rules = PLANNING, steps: int = 3, seed: int = 0) -> Trajectories:
    return collect(learner.network, board, steps, torch.Generator().manual_seed(seed), rules)


@pytest.mark.parametrize(
    ("ratio", "advantage", "centre", "expected"),
    [
        (1.5, 2.0, 1.0, 1.2 * 2),
        (1.5, -2.0, 1.0, 1.5 * -2),
        (0.5, 2.0, 1.0, 0.5 * 2),
        (0.5, -2.0, 1.0, 0.8 * -2),
        (1.1, 3.0, 1.0, 3.3),
        (2.4, 2.0, 2.0, 2.2 * 2),
        (2.4, -2.0, 2.0, 2.4 * -2),
        (1.5, 2.0, 2.0, 1.5 * 2),
        (1.5, -2.0, 2.0, 1.8 * -2),
        (0.1, -1.0, 0.1, -0.1),
    ],
)
def test_clipped_surrogate_matches_the_definition(
    ratio: float, advantage: float, centre: float, expected: float
) -> None:
    """(13), (14) with epsilon 0.2 around 1 and other centres: gains are clipped, losses are not."""
    got = clipped_surrogate(torch.tensor([ratio]), torch.tensor([advantage]), 0.2, torch.tensor([centre]))
    assert got.item() == pytest.approx(expected)


def test_surrogate_has_no_gradient_beyond_the_clip() -> None:
    """The surrogate has a gradient within the clipping interval, and none for gains beyond it."""
    ratio = torch.tensor([1.1, 1.3, 0.7, 1.3, 0.7], requires_grad=True)
    clipped_surrogate(ratio, torch.tensor([2.0, 2.0, -2.0, -2.0, 2.0]), 0.2).sum().backward()
    assert ratio.grad is not None
    assert ratio.grad.tolist() == [2.0, 0.0, 0.0, -2.0, 2.0]


def test_value_loss_matches_hand_calculation() -> None:
    """(15): half the mean of the squared errors 1, -3 and 2."""
    got = value_loss(torch.tensor([1.0, 5.0, 0.0]), torch.tensor([2.0, 2.0, 2.0]))
    assert got.item() == pytest.approx((1 + 9 + 4) / 6)


@pytest.mark.parametrize(
    ("divergence", "target", "expected"),
    [
        (0.021, 0.01, 1e-3 / 1.5),
        (0.019, 0.01, 1e-3),
        (0.006, 0.01, 1e-3),
        (0.004, 0.01, 1.5e-3),
        (9.0, None, 1e-3),
    ],
)
def test_learning_rate_adapts_to_the_divergence(divergence: float, target: float | None, expected: float) -> None:
    """It falls above twice the target, rises below half of it, and is constant without a target."""
    assert adapted_learning_rate(1e-3, divergence, target, 1.0) == pytest.approx(expected)


def test_learning_rate_is_bounded() -> None:
    """It stays between the lowest and the highest value, unless the highest is below the lowest."""
    assert adapted_learning_rate(1e-3, 0.0, 0.01, 1.2e-3) == 1.2e-3
    assert adapted_learning_rate(1.1 * MIN_LEARNING_RATE, 1.0, 0.01, 1.0) == MIN_LEARNING_RATE
    assert adapted_learning_rate(1e-3, 0.0, 0.01, 1e-6) == 1e-6


def test_schedule_lowers_the_learning_rate() -> None:
    """Without a target the learning rate decreases with progress to a fraction of its initial value."""
    learner = Ppo(SMALL, PpoParameters(learning_rate=1.0, max_learning_rate=1e-3, final_lr_fraction=0.1))
    for progress, expected in ((0.0, 1e-3), (0.5, 0.55e-3), (1.0, 1e-4)):
        learner.train_on(TrainingJob(0, 1, probe("pairing"), progress))
        assert learner.learning_rate == pytest.approx(expected)


@both_turns
def test_samples_of_fresh_games(board: Board, rules: Rules) -> None:
    """One sample per state of running games; advantages have mean 0 and standard deviation 1 over actions."""
    parameters = PpoParameters(gamma=0.9, gae_lambda=0.5)
    learner = Ppo(SMALL, parameters)
    fresh = played(learner, board, rules, steps=30)
    samples = on_policy_samples(fresh, parameters)
    assert len(samples.game) == fresh.evaluations
    assert (samples.centre == 1).all()
    real = samples.actions >= 0
    each = samples.advantage[:, None].expand_as(samples.actions)[real]
    assert each.mean().item() == pytest.approx(0, abs=1e-5)
    assert each.std().item() == pytest.approx(1, abs=1e-2)
    again, _ = log_probabilities(
        board[samples.game],
        samples.state,
        learner.network(board[samples.game], samples.state),
        samples.actions,
        rules,
    )
    torch.testing.assert_close(again, samples.log_probability)


@both_turns
def test_update_follows_the_gradient_of_the_loss(board: Board, rules: Rules) -> None:
    """One update by plain gradient descent changes the weights by the gradient of (13), (15) and the entropy."""
    parameters = PpoParameters(update_epochs=1, minibatch_size=10_000, max_grad_norm=1e9, vf_coef=0.7, ent_coef=0.1)
    learner = Ppo(SMALL, parameters, seed=3)
    fresh = played(learner, board, rules)
    samples = on_policy_samples(fresh, parameters)
    network = ActorCritic(SMALL)
    network.load_state_dict(learner.network.state_dict())
    scores = network(board[samples.game], samples.state)
    chance, entropy = log_probabilities(board[samples.game], samples.state, scores, samples.actions, rules)
    loss, count = torch.zeros(()), 0
    for state in range(len(samples.game)):
        for k in torch.nonzero(samples.actions[state] >= 0)[:, 0].tolist():
            loss = loss - (chance[state, k] - samples.log_probability[state, k]).exp() * samples.advantage[state]
            count += 1
    loss = loss / count + 0.7 * 0.5 * ((samples.target - scores.value) ** 2).mean() - 0.1 * entropy.mean()
    loss.backward()
    learner.optimiser = torch.optim.SGD(learner.network.parameters(), lr=0.1)
    learner.update(fresh, [], rules, torch.Generator().manual_seed(0), max_rate=0.1)
    for new, old in zip(learner.network.parameters(), network.parameters(), strict=True):
        slope = torch.zeros_like(old) if old.grad is None else old.grad
        torch.testing.assert_close(new, old - 0.1 * slope, atol=1e-5, rtol=1e-4)


def test_probabilities_follow_advantages(board: Board) -> None:
    """After an update the change of each action's probability has the sign of its advantage."""
    learner = Ppo(SMALL, PpoParameters(ent_coef=0.0, vf_coef=0.0))
    fresh = played(learner, board)
    samples = on_policy_samples(fresh, learner.parameters)
    learner.update(fresh, [], PLANNING, torch.Generator().manual_seed(0), max_rate=1e-3)
    scores = learner.network(board[samples.game], samples.state)
    now, _ = log_probabilities(board[samples.game], samples.state, scores, samples.actions)
    real = samples.actions >= 0
    shift = (now.detach() - samples.log_probability)[real]
    assert float((shift * samples.advantage[:, None].expand_as(real)[real]).mean()) > 0


def test_divergence_grows_with_the_step(board: Board) -> None:
    """Without a step the divergence is 0, and larger steps diverge more."""
    found = []
    for rate in (0.0, 1e-4, 1e-2):
        learner = Ppo(SMALL, PpoParameters(learning_rate=1e-2))
        fresh = played(learner, board)
        found.append(learner.update(fresh, [], PLANNING, torch.Generator().manual_seed(0), max_rate=rate)[0])
    assert found[0] == pytest.approx(0, abs=1e-6)
    assert 0 < found[1] < found[2]


@both_turns
def test_reuse_by_the_same_network_gives_the_same_samples(board: Board, rules: Rules) -> None:
    """Trajectories of the current network give the same samples, fresh or from the buffer."""
    learner = Ppo(SMALL, PpoParameters(minibatch_size=2))
    fresh = played(learner, board, rules, steps=30)
    new, again = (
        on_policy_samples(fresh, learner.parameters),
        off_policy_samples(learner.network, fresh, learner.parameters, rules),
    )
    assert torch.equal(new.game, again.game)
    assert torch.equal(new.actions, again.actions)
    for name in ("centre", "advantage", "target", "log_probability"):
        torch.testing.assert_close(getattr(new, name), getattr(again, name), atol=1e-4, rtol=1e-4)


@both_turns
def test_reuse_by_another_network_is_importance_corrected(board: Board, rules: Rules) -> None:
    """Ratios of old samples are centred at the current policy, and traces truncated by the ratio of whole steps."""
    parameters = PpoParameters(gamma=0.9, gae_lambda=0.8)
    old, new = Ppo(SMALL, seed=1), Ppo(SMALL, seed=2)
    kept = played(old, board, rules, steps=4)
    samples = off_policy_samples(new.network, kept, parameters, rules)
    scores = new.network(board[samples.game], samples.state)
    now, _ = log_probabilities(board[samples.game], samples.state, scores, samples.actions, rules)
    shift = now - samples.log_probability
    torch.testing.assert_close(samples.centre, shift.exp(), atol=1e-5, rtol=1e-4)
    torch.testing.assert_close(samples.log_probability, kept.log_probability[kept.alive])
    assert 0.01 < samples.centre[samples.actions >= 0].std() < 10
    value, likely = torch.zeros_like(kept.value), torch.ones_like(kept.value)
    value[kept.alive], likely[kept.alive] = scores.value.detach(), shift.sum(1).exp().detach().clamp(max=1.0)
    target = torch.zeros_like(value)
    for game in range(len(board.energy_weight)):  # V-trace's recursion, from the last step to the first
        after, later = kept.last_value[game], torch.zeros(())
        for t in reversed(torch.nonzero(kept.alive[:, game])[:, 0].tolist()):
            error = kept.reward[t, game] + 0.9 * after - value[t, game]
            target[t, game] = value[t, game] + likely[t, game] * (error + 0.9 * 0.8 * later)
            after, later = value[t, game], target[t, game] - value[t, game]
    torch.testing.assert_close(samples.target, target[kept.alive], atol=1e-4, rtol=1e-4)


def test_single_decision_leaves_weights_finite() -> None:
    """One agent, one task, one step: nothing can be compared, and weights stay finite."""
    board = layout(Instance(ability=[1], workload=[1]))
    learner = Ppo(SMALL)
    learner.update(played(learner, board, steps=1), [], PLANNING, torch.Generator(), max_rate=1e-3)
    assert weights(learner).isfinite().all()


def test_extreme_games_leave_weights_finite() -> None:
    """Extreme magnitudes and unservable tasks leave weights finite."""
    wild = [
        Instance(ability=[1e-9, 1e9], workload=[1e9, 1e-9], priority=[1e9, 0]),
        Instance(ability=[1, 2], workload=[1, 2], allowed_tasks=[[], []]),
        Instance(ability=[1, 2], workload=[0, 0]),
    ]
    board = layout(*wild)
    for parameters in (PpoParameters(), GappoParameters()):
        learner = Ppo(SMALL, parameters)
        for seed in range(3):
            fresh = played(learner, board, seed=seed, steps=5)
            old = learner.replay.draw(torch.Generator().manual_seed(seed))
            learner.update(fresh, [old] if old else [], PLANNING, torch.Generator(), max_rate=1e-2)
            learner.replay.add(fresh)
        assert weights(learner).isfinite().all()


def test_buffer_is_used_for_learning() -> None:
    """With a buffer the updates of the second job differ from those without, and cost more evaluations."""
    costs, ends = [], []
    for capacity in (0, 10_000):
        learner = Ppo(SMALL, PpoParameters(buffer_size=capacity))
        reports = [learner.train_on(TrainingJob(seed, 1, probe("pairing"))) for seed in range(2)]
        costs.append([report.evaluations for report in reports])
        ends.append(weights(learner))
        assert len(learner.replay) == (0 if capacity == 0 else sum(cost // 4 for cost in costs[0]))
    assert costs[0][0] == costs[1][0]
    assert costs[0][1] < costs[1][1]
    assert not torch.equal(*ends)


def test_job_statistics_match_the_games() -> None:
    """Decisions reach the number requested; rewards are in units of the utility, whatever their scale."""
    games = probe("pairing")
    reports = [
        Ppo(SMALL, PpoParameters(reward_scale=scale)).train_on(TrainingJob(0, 100, games)) for scale in (1.0, 50.0)
    ]
    assert all(report.decisions >= 100 for report in reports)
    assert all(-1 < report.reward < 1 for report in reports)
    assert all(report.entropy > 0 and report.approx_kl > 0 for report in reports)
    single = Ppo(SMALL).train_on(TrainingJob(0, 1, games))
    fresh = played(Ppo(SMALL), games.board, seed=0, steps=6)
    assert single.evaluations % (1 + PpoParameters().update_epochs) == 0
    assert 0 < single.decisions <= fresh.decisions


@pytest.mark.parametrize("parameters", [PpoParameters(), GappoParameters()], ids=["ppo", "gappo"])
def test_job_depends_only_on_state_and_job(parameters: PpoParameters) -> None:
    """Stored with its buffer and restored in another learner, training continues bit for bit."""
    assert_resumes_elsewhere(lambda seed: Ppo(SMALL, parameters, seed))


@pytest.mark.slow
def test_rewards_rise_with_simultaneous_choices() -> None:
    """Rewards rise to nine tenths of the optimum under the other turn rule as well."""
    games, learner = probe("right_task"), Ppo(SMALL, PpoParameters(learning_rate=3e-3))
    best = float((best_utility(games.board) - utility(games.board, reset(games.board), AT_ONCE)).mean())
    rewards = [learner.train_on(TrainingJob(seed, 150, games, rules=AT_ONCE)).reward for seed in range(28)]
    assert sum(rewards[-4:]) / 4 > 0.9 * best > sum(rewards[:4]) / 4


def test_initial_weights_use_their_own_generator() -> None:
    """The initial weights have their own seed; torch's global generator is not used."""
    torch.manual_seed(5)
    expected = torch.rand(3)
    torch.manual_seed(5)
    one, two, other = Ppo(SMALL, seed=1), Ppo(SMALL, seed=1), Ppo(SMALL, seed=2)
    assert torch.equal(torch.rand(3), expected)
    assert torch.equal(weights(one), weights(two))
    assert not torch.equal(weights(one), weights(other))
