"""A register of agents or tasks by id, with a bounded history of closed ones."""

from bisect import bisect_left
from collections.abc import Collection, Iterable, Iterator
from typing import Generic, TypeVar

from alloc.problems.arguments import shown
from alloc.problems.errors import InputError, nearest
from alloc.problems.missions.simulation.state import AgentState, TaskState

KEPT_CLOSED = 200
"""Number of the last closed entries that are always kept; at most twice as many are."""

One = TypeVar("One", AgentState, TaskState)


class Register(Generic[One]):
    """All agents or tasks that are not closed (failed, for agents), by index, and the last closed ones.

    Parameters
    ----------
    kind : str
        Name of an entry in error messages.
    all_there : list
        Initial entries.

    Attributes
    ----------
    lasting : list
        Entries that are not closed, by index.
    ever : int
        Total number of entries so far, which is the index of the next one.
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
        """Iterate over all known entries by index."""
        return iter(sorted(self._by_id.values(), key=_index))

    @property
    def is_full(self) -> bool:
        """Whether there are more closed entries than are kept."""
        return len(self._over) > 2 * KEPT_CLOSED

    def find(self, name: str | None) -> One:
        """Return an entry by its id; raise `InputError` if it is unknown."""
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
        """Add a new entry."""
        self.lasting.append(one)
        self._by_id[one.facts.id] = one
        self.ever = one.index + 1

    def file(self, one: One, *, is_over: bool) -> None:
        """Move a known entry to the closed ones, or to the others."""
        place = bisect_left(self.lasting, one.index, key=_index)
        is_there = place < len(self.lasting) and self.lasting[place] is one
        if is_over and is_there:
            del self.lasting[place]
            self._over[one.facts.id] = one
        elif not is_over and not is_there:
            self.lasting.insert(place, one)
            del self._over[one.facts.id]

    def forget(self, needed: Collection[str | None] = ()) -> None:
        """Forget the closed entries beyond the limit, oldest first, except needed ones."""
        for name in [*self._over][: max(0, len(self._over) - KEPT_CLOSED)] if self.is_full else ():
            if name not in needed:
                del self._over[name], self._by_id[name]

    def restore(self, names: Collection[str], later: Iterable[One], ever: int) -> None:
        """Restrict the register to the saved names, taken from the initial entries and from `later` ones."""
        known = dict.fromkeys(names)
        self._by_id = {one.facts.id: one for one in (*self, *later) if one.facts.id in known}
        if len(self._by_id) < len(known):
            raise ValueError(f"a saved {self._kind} is missing")
        self.lasting[:] = self._by_id.values()
        self._over.clear()
        self.ever = ever


def _index(one: AgentState | TaskState) -> int:
    return one.index
