"""Mutation of the genetic algorithm: exchanges of agents between tasks with a surplus and with a shortfall.

In contrast to local search, mutation evaluates no fitness, and neither repeats nor undoes a change: that is left to
selection.
"""

from dataclasses import dataclass

import numpy as np

from alloc.allocators.contract.parameters import CheckedParameters, bounded
from alloc.allocators.heuristic.genetic.coalitions import TwoColumns, coalitions, exchange_cost, members
from alloc.allocators.heuristic.genetic.encoding import ROUNDING, Encoding, Genes
from alloc.allocators.heuristic.genetic.operators import draw_column, roulette
from alloc.problems.instance import FloatArray, IntArray


@dataclass(frozen=True)
class MutationParameters(CheckedParameters):
    """Parameters of mutation.

    Attributes
    ----------
    exchanges : float
        Mean number of exchanges in a child, drawn geometrically.
    most_exchanges : int
        Maximum number of exchanges in a child.
    uniform : float
        Probability that a task is drawn regardless of surplus and shortfall.
    temperature : float
        Scale of the noise on the choice of agents, in units of mean ability per mean demand.
    distance_weight : float
        Largest weight of the mean distance saved, relative to the demand of a task.
    saving : float
        Probability, if energy counts and no task has a shortfall, that the agent is drawn by its distance, and the task
        by the distance that it would save there.
    pairs : float
        Probability that up to two agents of each group are exchanged instead of one.
    group_cap, pair_cap : int
        Number of agents of a group that are considered for exchanges of single agents and of pairs, drawn at random
        from larger groups.
    """

    exchanges: float = bounded(2.0, low=1)
    most_exchanges: int = bounded(8, low=1)
    uniform: float = bounded(0.1, low=0, high=1)
    temperature: float = bounded(0.1, low=0)
    distance_weight: float = bounded(0.7, low=0)
    saving: float = bounded(0.8, low=0, high=1)
    pairs: float = bounded(0.1, low=0, high=1)
    group_cap: int = bounded(16, low=1)
    pair_cap: int = bounded(6, low=1)


def mutate(
    genes: Genes,
    target_makespan: float,
    encoding: Encoding,
    rng: np.random.Generator,
    *,
    energy_counts: bool = False,
    parameters: MutationParameters = MutationParameters(),
) -> Genes:
    """Exchange agents a few times in each row, in place, and return the rows.

    An exchange takes one or two agents of a task with a surplus, and up to two of a task with a shortfall, such that
    the difference of their abilities roughly fits. If there is no shortfall, any two tasks are used. No agent is
    assigned to a task that it cannot reach.

    Parameters
    ----------
    genes : ndarray of int, shape (rows, n)
    target_makespan : float
        Makespan in hours to which shortfalls and surpluses refer.
    encoding : Encoding
    rng : Generator
    energy_counts : bool
        Whether distances influence the choice of the agents.
    parameters : MutationParameters
    """
    group = encoding.group_abilities(genes)
    demand = np.append(encoding.demand(target_makespan), 0.0)
    times = rng.geometric(1 / parameters.exchanges, size=len(genes)).clip(max=parameters.most_exchanges)
    for turn in range(int(times.max(initial=0))):
        row = np.flatnonzero(times > turn)
        excess = group[row] - demand
        target = draw_column(np.maximum(0.0, -excess[:, :-1]), rng, parameters.uniform)
        giver = _draw_giver(genes[row], np.maximum(0.0, excess), target, encoding, rng, parameters.uniform)
        if energy_counts:
            no_shortfall = (excess >= -ROUNDING * demand).all(axis=1)
            saving = np.flatnonzero(no_shortfall & (rng.random(len(row)) < parameters.saving))
            giver[saving], target[saving] = draw_saving_move(genes[row[saving]], encoding, rng)
        source = genes[row, giver].astype(np.intp)
        differ = np.flatnonzero(source != target)
        if len(differ):
            columns = TwoColumns(row[differ], source[differ], target[differ])
            _exchange(genes, group, demand, columns, encoding, rng, energy_counts, parameters)
    return genes


def _exchange(
    genes: Genes,
    group: FloatArray,
    demand: FloatArray,
    columns: TwoColumns,
    encoding: Encoding,
    rng: np.random.Generator,
    energy_counts: bool,
    parameters: MutationParameters,
) -> None:
    """Exchange agents of both columns in each row, and update `group`."""
    some, ability = genes[columns.row], encoding.ability
    pairs = rng.random() < parameters.pairs
    cap = parameters.pair_cap if pairs else parameters.group_cap
    givers = coalitions(members(some, columns.source, cap, encoding.no_agent, rng), pairs)
    takers = coalitions(members(some, columns.target, cap, encoding.no_agent, rng), pairs)
    noise = parameters.temperature * ability.mean() / demand.mean()
    distance_weight = parameters.distance_weight if energy_counts else None
    cost = exchange_cost(givers, takers, group, demand, columns, encoding, rng, noise, distance_weight)
    flat = cost.reshape(len(some), -1)
    best = flat.argmin(axis=1)
    k = np.flatnonzero(flat[np.arange(len(some)), best] < np.inf)
    going, coming = givers[k, best[k] // takers.shape[1]], takers[k, best[k] % takers.shape[1]]
    for agents, column in ((going, columns.target[k]), (coming, columns.source[k])):
        which, member = np.nonzero(agents < encoding.no_agent)
        genes[columns.row[k][which], agents[which, member]] = column[which]
    change = ability[going].sum(axis=1) - ability[coming].sum(axis=1)
    group[columns.row[k], columns.source[k]] -= change
    group[columns.row[k], columns.target[k]] += change


def _draw_giver(
    some: Genes,
    surplus: FloatArray,
    target: IntArray,
    encoding: Encoding,
    rng: np.random.Generator,
    uniform: float,
) -> IntArray:
    """Draw an agent of each row in proportion to the surplus of its group, from those that can go to `target`."""
    ignored = (rng.random(len(some)) < uniform) | ~(surplus.max(axis=1) > 0)
    weight = np.take_along_axis(np.where(ignored[:, None], 1.0, surplus), some.astype(np.intp), axis=1)
    weight[some == target[:, None]] = 0.0
    if not encoding.is_complete:
        weight = weight * encoding.allows(np.arange(encoding.n)[None, :], target[:, None])
    return roulette(weight, rng)


def draw_saving_move(some: Genes, encoding: Encoding, rng: np.random.Generator) -> tuple[IntArray, IntArray]:
    """Draw an agent of each row in proportion to its distance, and a column by the square of the distance saved."""
    agents = np.arange(encoding.n)[None, :]
    cost = encoding.cost(agents, some.astype(np.intp))
    giver = roulette(cost, rng)
    columns = np.arange(encoding.idle)[None, :]
    saved = np.take_along_axis(cost, giver[:, None], axis=1) - encoding.cost(giver[:, None], columns)
    saved = np.maximum(0.0, saved) ** 2 * encoding.allows(giver[:, None], columns)
    return giver, roulette(saved, rng)
