"""Selection, crossover and mutation of the genetic algorithm, each on many rows of genes at once.

All randomness comes from the generator that is passed in, never from the global `random` of DEAP's own operators, so
that runs in several threads do not disturb each other. Mutation knows the problem: it moves ability from tasks with a
surplus to tasks with a deficit. Whether a child is any good is for selection alone to decide: no operator asks for a
fitness, tries again or takes a change back, which is where local search would begin.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from alloc.allocators.heuristic.genetic.population import ROUNDING, BoolArray, Genes, Landscape
from alloc.problems.instance import FloatArray, IntArray


def tournament(size: int, rounds: int, rng: np.random.Generator, entrants: int = 3) -> IntArray:
    """Return the winners of `rounds` tournaments among `size` individuals in order of fitness, best first.

    As they stand in order, the winner is the least of the numbers drawn (Goldberg and Deb 1991,
    doi:10.1016/B978-0-08-050684-5.50008-2).
    """
    winners: IntArray = rng.integers(size, size=(rounds, entrants)).min(axis=1)
    return winners


def cross_groups(one: Genes, other: Genes, share: FloatArray, rng: np.random.Generator) -> Genes:
    """Give each row of `one` whole groups of the row beside it in `other`, and return the children.

    A random set of tasks is drawn, each with probability `share` of its row. Their groups are those of `other` in the
    child; whoever was in them before goes where `other` has it. All other agents stay. Every gene is thus that of a
    parent, so that no child sends an agent where it cannot go.

    References
    ----------
    Falkenauer (1994), doi:10.1162/evco.1994.2.2.123: groups, not single genes, are what is worth inheriting. Tasks
    are told apart here, unlike the bins there, so that no group has to be dissolved and filled anew.
    """
    rows, width = len(one), int(max(one.max(), other.max())) + 1
    taken = (rng.random((rows, width)) < share[:, None]).ravel()
    cell = (np.arange(rows) * width)[:, None]
    return np.where(taken[one + cell] | taken[other + cell], other, one)


@dataclass(frozen=True)
class Mutation:
    """How agents are exchanged between two tasks.

    Attributes
    ----------
    exchanges : float
        Mean number of exchanges in a child, drawn geometrically.
    most : int
        Most exchanges in a child.
    stray : float
        Probability that a task is drawn without regard to surplus and deficit.
    temperature : float
        Spread of the random term in the choice of the agents, in units of mean ability per mean demand.
    economy : float
        Weight, at most, of a mean distance saved, against a task's whole demand missed.
    homeward : float
        Probability, where energy counts and no task lacks anything, that the agent is drawn by the length of its flight
        and the task by what the agent would save there.
    pairs : float
        Probability that up to two agents of each group, not one, change places.
    group_cap, pair_cap : int
        Agents of a group that are looked at, drawn at random in larger groups; for single agents and for pairs.
    """

    exchanges: float = 2.0
    most: int = 8
    stray: float = 0.1
    temperature: float = 0.1
    economy: float = 0.7
    homeward: float = 0.8
    pairs: float = 0.1
    group_cap: int = 16
    pair_cap: int = 6


def mutate(
    genes: Genes,
    aim: float,
    landscape: Landscape,
    rng: np.random.Generator,
    *,
    economical: bool = False,
    settings: Mutation = Mutation(),
) -> Genes:
    """Exchange agents a few times in each row, in place, and return the rows.

    An exchange takes a task that lacks ability at the makespan `aim`, another one that has too much, an agent (or two)
    of the second and an agent (or two, or nobody) of the first, such that the difference of the abilities about fits.
    Where nothing is lacking, any two tasks do. Nobody is sent where it cannot go.

    Parameters
    ----------
    genes : ndarray of int, shape (rows, n)
    aim : float
        Makespan in hours that the tasks are to meet.
    landscape : Landscape
    rng : Generator
    economical : bool
        Whether distances have a say in the choice of the agents.
    settings : Mutation
    """
    group = landscape.group_abilities(genes)
    demand = np.append(landscape.demand(aim), 0.0)
    times = rng.geometric(1 / settings.exchanges, size=len(genes)).clip(max=settings.most)
    for turn in range(int(times.max(initial=0))):
        row = np.flatnonzero(times > turn)
        excess = group[row] - demand
        to = _draw(np.maximum(0.0, -excess[:, :-1]), rng, settings.stray)
        giver = _draw_giver(genes[row], np.maximum(0.0, excess), to, landscape, rng, settings.stray)
        if economical:
            home = np.flatnonzero(
                (excess >= -ROUNDING * demand).all(axis=1) & (rng.random(len(row)) < settings.homeward)
            )
            giver[home], to[home] = _draw_homeward(genes[row[home]], landscape, rng)
        out = genes[row, giver].astype(np.intp)
        differ = np.flatnonzero(out != to)
        if len(differ):
            pair = _Pair(row[differ], out[differ], to[differ])
            _exchange(genes, group, demand, pair, landscape, rng, economical, settings)
    return genes


@dataclass(frozen=True, eq=False)
class _Pair:
    """Two columns in each of some rows, between which agents are exchanged; each of shape (k,)."""

    row: IntArray
    out: IntArray
    to: IntArray


def _exchange(
    genes: Genes,
    group: FloatArray,
    demand: FloatArray,
    pair: _Pair,
    landscape: Landscape,
    rng: np.random.Generator,
    economical: bool,
    settings: Mutation,
) -> None:
    """Exchange agents of ``pair.out`` with agents of ``pair.to``, and keep `group` up to date."""
    some = genes[pair.row]
    couples = rng.random() < settings.pairs
    cap = settings.pair_cap if couples else settings.group_cap
    givers = _coalitions(_members(some, pair.out, cap, landscape.nobody, rng), couples)
    takers = _coalitions(_members(some, pair.to, cap, landscape.nobody, rng), couples)
    ability = landscape.ability
    moved = ability[givers].sum(axis=2)[:, :, None] - ability[takers].sum(axis=2)[:, None, :]
    misfit = _misfit(moved, group, demand, pair)
    spread = settings.temperature * ability.mean() / demand.mean() * rng.random((len(some), 1, 1))
    misfit += spread * rng.standard_exponential(misfit.shape)
    if economical:
        price = settings.economy / landscape.mean_distance * rng.random((len(some), 1, 1)) ** 2
        misfit += price * _detour(givers, takers, pair, landscape)
    misfit[~_possible(givers, takers, pair, landscape)] = np.inf
    flat = misfit.reshape(len(some), -1)
    best = flat.argmin(axis=1)
    k = np.flatnonzero(flat[np.arange(len(some)), best] < np.inf)
    going, coming = givers[k, best[k] // takers.shape[1]], takers[k, best[k] % takers.shape[1]]
    for agents, goal in ((going, pair.to[k]), (coming, pair.out[k])):
        which, member = np.nonzero(agents < landscape.nobody)
        genes[pair.row[k][which], agents[which, member]] = goal[which]
    change = ability[going].sum(axis=1) - ability[coming].sum(axis=1)
    group[pair.row[k], pair.out[k]] -= change
    group[pair.row[k], pair.to[k]] += change


def _misfit(moved: FloatArray, group: FloatArray, demand: FloatArray, pair: _Pair) -> FloatArray:
    """Return what the two tasks would lack after `moved` goes over, as shares of their demands."""
    lack: FloatArray = np.zeros(moved.shape)
    mean = demand[:-1].mean()
    for column, sign in ((pair.out, -1.0), (pair.to, 1.0)):
        need = demand[column]
        scale = np.where(need > 0, need, mean)[:, None, None]
        excess = (group[pair.row, column] - need)[:, None, None]
        lack += np.maximum(0.0, -(excess + sign * moved)) / scale
    return lack


def _detour(givers: IntArray, takers: IntArray, pair: _Pair, landscape: Landscape) -> FloatArray:
    """Return the distance that each exchange adds."""
    out, to = pair.out[:, None, None], pair.to[:, None, None]
    here = (landscape.distance(givers, to) - landscape.distance(givers, out)).sum(axis=2)
    there = (landscape.distance(takers, out) - landscape.distance(takers, to)).sum(axis=2)
    detour: FloatArray = here[:, :, None] + there[:, None, :]
    return detour


def _possible(givers: IntArray, takers: IntArray, pair: _Pair, landscape: Landscape) -> BoolArray:
    """Whether both coalitions exist, can go, and are not both nobody."""
    go = np.all(landscape.allows(givers, pair.to[:, None, None]) & (givers >= 0), axis=2)
    come = np.all(landscape.allows(takers, pair.out[:, None, None]) & (takers >= 0), axis=2)
    possible: BoolArray = go[:, :, None] & come[:, None, :]
    possible[:, 0, 0] = False
    return possible


def _coalitions(members: IntArray, couples: bool) -> IntArray:
    """Return all coalitions of one member, or of at most two, shape (k, coalitions, 1 or 2); the first is nobody."""
    if not couples:
        return members[:, :, None]
    one, other = np.triu_indices(members.shape[1])
    distinct = (one != other) | (one == 0)
    return np.stack([members[:, one[distinct]], members[:, other[distinct]]], axis=2)


def _members(some: Genes, column: IntArray, cap: int, nobody: int, rng: np.random.Generator) -> IntArray:
    """Return nobody, then up to `cap` members of a group in each row, then -1; shape (k, at most cap + 1)."""
    row, agent = np.nonzero(some == column[:, None])
    size = np.bincount(row, minlength=len(some))
    place = np.arange(len(row)) - (np.cumsum(size) - size)[row]
    most = int(size.max(initial=0))
    if most > cap:
        place = (place + rng.integers(most, size=len(some))[row]) % size[row]
        row, agent, place = row[place < cap], agent[place < cap], place[place < cap]
    table = np.full((len(some), min(most, cap) + 1), -1, dtype=np.intp)
    table[:, 0] = nobody
    table[row, place + 1] = agent
    return table


def _draw(weight: FloatArray, rng: np.random.Generator, stray: float) -> IntArray:
    """Draw a column of each row with probability in proportion to its weight, or, now and then, any column."""
    plain = (rng.random(len(weight)) < stray) | ~(weight.max(axis=1) > 0)
    return _roulette(np.where(plain[:, None], 1.0, weight), rng)


def _draw_giver(
    some: Genes, surplus: FloatArray, to: IntArray, landscape: Landscape, rng: np.random.Generator, stray: float
) -> IntArray:
    """Draw an agent of each row in proportion to the surplus of its group, from those that can go to column `to`."""
    plain = (rng.random(len(some)) < stray) | ~(surplus.max(axis=1) > 0)
    weight = np.take_along_axis(np.where(plain[:, None], 1.0, surplus), some.astype(np.intp), axis=1)
    weight[some == to[:, None]] = 0.0
    if not landscape.is_complete:
        weight = weight * landscape.allows(np.arange(landscape.n)[None, :], to[:, None])
    return _roulette(weight, rng)


def _draw_homeward(some: Genes, landscape: Landscape, rng: np.random.Generator) -> tuple[IntArray, IntArray]:
    """Draw an agent of each row in proportion to its flight, and a task in proportion to what it would save there."""
    agents = np.arange(landscape.n)[None, :]
    flown = landscape.distance(agents, some.astype(np.intp))
    giver = _roulette(flown, rng)
    columns = np.arange(landscape.bench)[None, :]
    saved = np.take_along_axis(flown, giver[:, None], axis=1) - landscape.distance(giver[:, None], columns)
    saved = np.maximum(0.0, saved) ** 2 * landscape.allows(giver[:, None], columns)
    return giver, _roulette(saved, rng)


def _roulette(weight: FloatArray, rng: np.random.Generator) -> IntArray:
    """Draw one column of each row in proportion to its weight; any where all weights are 0."""
    largest = weight.max(axis=1, keepdims=True)
    total = np.cumsum(weight / np.where(largest > 0, largest, 1.0), axis=1)  # so that no sum overflows
    mark = rng.random((len(weight), 1)) * total[:, -1:]
    drawn: NDArray[np.intp] = (total <= mark).sum(axis=1).clip(max=weight.shape[1] - 1)
    return drawn
