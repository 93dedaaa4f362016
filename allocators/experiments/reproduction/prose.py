"""What the page says in words, whatever the rows are."""

HEAD = """# The paper's experiments, made anew

Section 4 of the paper ([what we made of it](paper/paper.md)) has five learning methods in four scenarios, convergence
in figures 2 to 5, and the battery left in figure 6. This page repeats it: every method learns from nothing, with the
same network, first weights, games, number of decisions and number of tuning trials. It is about learning with small
budgets; how good the trained methods that ship are is in [gappo.md](methods/gappo.md). All of it is made by one command
from rows that lie beside the page.

    alloc reproduce folder --runs 100        # as many runs as the paper; hours
    alloc reproduce folder --quick           # two short runs; minutes
    alloc reproduce folder --runs 10 --methods gappo,gappo-unshared    # a part of GAPPO left out
    alloc reproduce folder --page            # figures and page from the rows that are there

Ctrl-C keeps the runs that have ended, and the same command goes on from there."""

FIGURES = """As in the paper, with the proven lower bound of the makespan as a pink dotted line, a median over the
instances. The panel on the right has what methods that learn nothing reach on the same instances."""

ABLATION = """Each variant lacks one part of `gappo` and is the same in all else, also in step sizes and all that was
tuned for `gappo`. Differences are on the test games, the variant less `gappo`: above 0 the part is of use. They are
paired by run, with intervals and tests as in the tables above."""

PROCEDURE = """## How it is measured
- **Length**: schedules of step sizes end with the run, so that short runs are no beginnings of long ones. Claims and
  figures are of the longest runs. Step sizes were tuned for 300 iterations.
- **Test games**: twelve instances of scenario 1, the same for all runs, played greedily; T is that of the median
  game at its best position. *Best of 8 drawn* is the mean over these instances of the best T in 8 games with drawn
  bids; the members of a population play in turn. Differences are paired by run, as all methods of a run have the
  same first weights, with BCa bootstrap intervals of 95 % and Wilcoxon's signed-rank test; p is corrected by Holm's
  procedure over all tests of a table, or of a claim. *Holds* wants p < 0.05 against every rival,
  *does not hold* eight runs at least, as fewer could not show the opposite. Intervals of fewer than ten
  runs say little.
- **Descriptive claims** have no test: the two comparisons with methods that learn nothing, and figure 6, are decided by
  means or medians, and want eight runs of both sides for either verdict; *holds* wants them of every rival in every
  scenario. Two claims are about every run (*consistently* optimal, and T below 1.1 in scenarios 2 to 4): a single run
  refutes them, and *holds* wants eight in each scenario.
- **Scenarios**: the first ten runs of a method have an instance of each scenario, later ones of scenario 1 alone (some
  were made before that rule, with all four). The policy plays one greedy game on each. T is infinite
  while a task has no agent; means and differences are of the others, with the
  number of those left out, medians of all.
- **Decisions** are those of agents in the games that are learned from, of all members of a population together.
  GAPPO compares its members by these same games, so that no others are spent on it."""

ASSUMPTIONS = """## Assumptions
What the paper leaves open, and what we took; [paper.md](paper/paper.md) has the equations."""

ASSUMED: tuple[tuple[str, str], ...] = (
    (
        "iteration",
        "200 decisions of agents, and the updates that belong to them; 300 iterations are 60,000 decisions. "
        "Scenario 1 is shown up to its 200, where step sizes have not come down yet",
    ),
    (
        "games that are learned from",
        "drawn like the paper's, with 4 to 10 tasks and at most 50 agents, not the scenario itself: the "
        "network takes any size, and one training serves all four scenarios",
    ),
    (
        "what is shown over iterations",
        "a greedy game of the policy as it is then, from the random first allocation, at its best position",
    ),
    (
        "run",
        "a training, with other first weights, games and instances",
    ),
    (
        "hyperparameters",
        "the best of twelve trials of 60,000 decisions each, by the search of `alloc tune`, defaults among "
        "them; `gappo` extends PPO and has those of `ppo`, with the divergence target from twelve trials of "
        "its own, and nothing else of it was tuned",
    ),
    (
        "population of GAPPO",
        "three members that share one network but for its biases, one replay buffer (C = 10,000 states), "
        "whose samples are corrected for the member that played them",
    ),
    (
        "fitness (12)",
        "mean return and entropy over the member's last ten updates, cost by evaluated states; a generation "
        "every 30 updates",
    ),
    (
        "`gappo-single`",
        "the same without a population: one member, all else alike",
    ),
    (
        "reward",
        "makespan by a potential, less 0.3 times the distance; with (3) by itself nothing would save energy",
    ),
    (
        "turns",
        "agents bid in rounds instead of choosing all at once",
    ),
    (
        "battery",
        "20 and 30 units as in the paper, 6 units per unit of distance in a unit cube; hop by hop in the episode",
    ),
    (
        "workloads",
        "distinct positive whole numbers, a Dirichlet(2) spread",
    ),
    (
        "DDPG",
        "relaxed to choices by a softmax over bids",
    ),
)
"""What is open, and ours."""

SEEDS = """Hyperparameters were chosen with validation seeds and instances (from 2 × 10^9); runs are judged on
instances that nothing was trained or tuned on."""
