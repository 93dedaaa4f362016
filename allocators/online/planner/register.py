"""Agents or tasks by their ids, of which not all that ever were are kept."""

from bisect import bisect_left
from collections.abc import Collection, Iterable, Iterator
from typing import Generic, TypeVar

from alloc.problems.arguments import shown
from alloc.problems.errors import InputError, nearest
from alloc.problems.missions.simulation.state import AgentState, TaskState

MOST_OVER = 200
"""How many are kept at least of those that are over, the last ones; twice as many at most."""

One = TypeVar("One", AgentState, TaskState)


class Register(Generic[One]):
    """Those that are not over, in the order in which they came, and the last of those that are.

    Parameters
    ----------
    kind : str
        What they are called in errors.
    all_there : list
        With which it begins.

    Attributes
    ----------
    lasting : list
        Those that are not over, by their index.
    ever : int
        How many there were in all, which is the index of the next one.
    """

    def __init__(self, kind: str, all_there: list[One]) -> None:
        self._kind, self.lasting, self.ever = kind, [*all_there], len(all_there)
        self._by_id: dict[str, One] = {one.facts.id: one for one in all_there}
        self._over: dict[str, One] = {}

    def __contains__(self, name: str) -> bool:
        return name in self._by_id

    def __len__(self) -> int:
        return len(self._by_id)

    def __iter__(self) -> Iterator[One]:
        """All that are known, by their index."""
        return iter(sorted(self._by_id.values(), key=_index))

    @property
    def is_full(self) -> bool:
        """Whether more are over than are kept."""
        return len(self._over) > 2 * MOST_OVER

    def find(self, name: str | None) -> One:
        """Return one by its id; an unknown id is an `InputError`."""
        one = self._by_id.get(str(name))
        if one is None:
            raise InputError(
                f"there is no {self._kind} {shown(name)}{nearest(str(name), tuple(self._by_id))}", self._kind
            )
        return one

    def require_new(self, name: str) -> None:
        """Raise `InputError` if an id is taken."""
        if name in self._by_id:
            raise InputError(f"there is {self._kind} {shown(name)} already", f"{self._kind}.id")

    def add(self, one: One) -> None:
        """Add one that came last of all."""
        self.lasting.append(one)
        self._by_id[one.facts.id] = one
        self.ever = one.index + 1

    def file(self, one: One, *, is_over: bool) -> None:
        """Keep one that is known among those that are over, or among the others."""
        place = bisect_left(self.lasting, one.index, key=_index)
        is_there = place < len(self.lasting) and self.lasting[place] is one
        if is_over and is_there:
            del self.lasting[place]
            self._over[one.facts.id] = one
        elif not is_over and not is_there:
            self.lasting.insert(place, one)
            del self._over[one.facts.id]

    def forget(self, needed: Collection[str | None] = ()) -> None:
        """Forget those that were over first, where more are over than are kept, but for those that are needed."""
        for name in [*self._over][: max(0, len(self._over) - MOST_OVER)] if self.is_full else ():
            if name not in needed:
                del self._over[name], self._by_id[name]

    def restore(self, names: Collection[str], later: Iterable[One], ever: int) -> None:
        """Know these alone, as when a planner was saved: of those that were there, and of those that came later."""
        known = dict.fromkeys(names)
        self._by_id = {one.facts.id: one for one in (*self, *later) if one.facts.id in known}
        if len(self._by_id) < len(known):
            raise ValueError(f"some {self._kind} is not there")
        self.lasting[:] = self._by_id.values()
        self._over.clear()
        self.ever = ever


def _index(one: AgentState | TaskState) -> int:
    return one.index
