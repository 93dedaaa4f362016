"""Text of the reproduction page that does not depend on the rows."""

HEAD = """# Reproduction of the paper's experiments

Section 4 of the paper ([our reading of it](paper/paper.md)) compares five learning methods in four scenarios: figures 2
to 5 show convergence, figure 6 the remaining battery. This page repeats these experiments. Every method is trained from
scratch, with the same network, initial weights, games, number of decisions and number of tuning trials. The page is
about learning with small budgets; for the quality of the policies that ship with `alloc`, see
[gappo.md](methods/gappo.md). One command generates page and figures from the rows stored in `docs/reproduction`.

    alloc reproduce folder --runs 100        # as many runs as in the paper; takes hours
    alloc reproduce folder --quick           # two short runs; takes minutes
    alloc reproduce folder --runs 10 --methods gappo,gappo-unshared    # an ablation of GAPPO
    alloc reproduce folder --page            # only redraw figures and page from stored rows

Ctrl-C keeps all finished runs; the same command resumes from there."""

FIGURES = """In the form of the paper. The pink dotted line is the proven lower bound on the makespan (median over the
instances); the panel on the right shows the methods that do not learn, on the same instances."""

ABLATION = """Each variant removes one component of `gappo` and keeps everything else, including the step sizes and
all other hyperparameters tuned for `gappo`. Differences are variant minus `gappo` on the test games, paired by run:
a positive difference means that the component helps. Intervals and tests are as in the tables above."""

PROCEDURE = """## Experimental procedure
- **Length**: step-size schedules end with the run, so a short run is not a prefix of a longer one. Claims and figures
  use the longest runs. Step sizes were tuned for 300 iterations.
- **Test games**: twelve instances of scenario 1, the same for all runs, played greedily; T is the makespan of the
  median game at its best state. *Best of 8 sampled* is the best T of 8 games with sampled bids, averaged over these
  instances; the members of a population take turns. Differences are paired by run, as all methods share the initial
  weights of a run, with 95 % BCa bootstrap intervals and Wilcoxon's signed-rank test; p-values are corrected by Holm's
  procedure over all tests of a table or of a claim. *Holds* requires p < 0.05 against every rival; *does not hold*
  requires at least eight runs, as fewer could not have shown the opposite. Intervals of fewer than ten runs say little.
- **Descriptive claims** are not tested: the two comparisons with methods that do not learn, and figure 6, are decided
  by means or medians. Either verdict requires eight runs of both sides; *holds* requires them for every rival in every
  scenario. Two claims are about every run (*consistently* optimal, and T below 1.1 in scenarios 2 to 4): a single
  counterexample refutes them, and *holds* requires eight runs in each scenario.
- **Scenarios**: the first ten runs of a method are evaluated on one instance of each scenario, later runs on one of
  scenario 1 only (some runs made before this rule have all four). The policy plays one greedy game on each. T is
  infinite while a task has no agent; means and differences leave out infinite values and say how many;
  medians include them.
- **Decisions** count the choices of all agents in training games, over all members of a population together. GAPPO
  evaluates the fitness of its members on these same games, so that selection costs no further games."""

ASSUMPTIONS = """## Assumptions
What the paper leaves open, and our choices; [paper.md](paper/paper.md) has the equations."""

ASSUMED: tuple[tuple[str, str], ...] = (
    (
        "iteration",
        "200 decisions of agents, and the updates made from them; 300 iterations are 60,000 decisions. "
        "Scenario 1 is shown up to iteration 200, as in the paper, before the step sizes have decayed",
    ),
    (
        "training games",
        "drawn from the paper's distribution, with 4 to 10 tasks and at most 50 agents, not the scenario itself: "
        "the network accepts any size, and one training serves all four scenarios",
    ),
    (
        "convergence curve",
        "one greedy game of the current policy from a random initial allocation, at its best state",
    ),
    (
        "run",
        "one training, with its own initial weights, games and instances",
    ),
    (
        "hyperparameters",
        "the best of twelve trials of 60,000 decisions each by `alloc tune`, including the defaults; `gappo` "
        "extends PPO and uses the hyperparameters of `ppo`, with a target divergence from twelve trials of its "
        "own; nothing else of it was tuned",
    ),
    (
        "population of GAPPO",
        "three members that share one network except for its biases, and one replay buffer (C = 10,000 states) "
        "with importance weights for the member that acted",
    ),
    (
        "fitness (12)",
        "mean return and entropy over a member's last ten updates, cost as the number of evaluated states; one "
        "generation every 30 updates",
    ),
    (
        "`gappo-single`",
        "`gappo` with a population of one",
    ),
    (
        "reward",
        "potential-based on the makespan, minus 0.3 times the distance; (3) alone gives no reason to save energy",
    ),
    (
        "turns",
        "agents bid in rounds instead of choosing simultaneously",
    ),
    (
        "battery",
        "20 and 30 units as in the paper; 6 units per unit of distance in a unit cube; every hop of the episode counts",
    ),
    (
        "workloads",
        "distinct positive integers, proportions from a Dirichlet(2) distribution",
    ),
    (
        "DDPG",
        "discrete choices relaxed by a softmax over bids",
    ),
)
"""What the paper leaves open, and our choice."""

SEEDS = """Hyperparameters were chosen with validation seeds and instances (seeds from 2 × 10^9); runs are evaluated on
instances that were used neither for training nor for tuning."""
