"""The contract of an allocator: it receives a `Search` and returns a `Proposal`."""

from abc import abstractmethod
from dataclasses import dataclass
from typing import ClassVar

from alloc.allocators.contract.budget import Budget
from alloc.allocators.contract.method import Method
from alloc.allocators.contract.parameters import Parameterised
from alloc.allocators.contract.search import Search
from alloc.problems import Allocation, Instance, Objective


@dataclass(frozen=True)
class Proposal:
    """What an allocator returns; `solve` scores it.

    Attributes
    ----------
    allocation : Allocation or None
        The answer; None stands for the best allocation passed to `Search.submit`, if any.
    makespan_lower_bound : float or None
        Proven lower bound on the makespan, in hours, of every allocation that serves all tasks.
    energy_lower_bound : float or None
        Proven lower bound on the energy of every allocation whose makespan is at most that of the answer.
    notes : tuple of str
        Messages for the user; they are added to `Result.notes`.
    """

    allocation: Allocation | None = None
    makespan_lower_bound: float | None = None
    energy_lower_bound: float | None = None
    notes: tuple[str, ...] = ()


class Allocator(Parameterised):
    """A method that is loaded and ready; one object can be used for many instances, from several threads at once.

    Subclasses set `method`, and `parameters_type` if they have parameters; `allocate` must not change attributes.

    Parameters
    ----------
    parameters : parameters_type, optional
        All parameters; the defaults if None.
    **settings
        Single parameters by name, such as ``population=200``.

    Attributes
    ----------
    method : Method
        Name and capabilities.
    parameters_type : type or None
        Frozen dataclass of the parameters, with a default for each; None for a method without parameters.
    parameters : parameters_type
        The parameters in use; only if `parameters_type` is not None.

    Raises
    ------
    InputError
        If there is no such parameter, or its value is wrong; its `place` is the name of the parameter.
    """

    method: ClassVar[Method]

    @classmethod
    def _title(cls) -> str:
        return f"method {cls.method.name!r}"

    def refusal(self, instance: Instance, objective: Objective, budget: Budget) -> str | None:
        """Return why the method cannot keep to `budget` on `instance`, or None if it can.

        Parameters
        ----------
        instance : Instance
        objective : Objective
        budget : Budget

        Returns
        -------
        str or None
            Determined within milliseconds, without building a model.
        """
        return None

    def prepare(self, instance: Instance) -> None:
        """Load what a run on the instance needs besides the method itself, such as compiled loops.

        Called after `refusal` and before the clock starts: loading is not part of the run, and neither is importing.

        Parameters
        ----------
        instance : Instance
            Must not be used for computations here.
        """

    @abstractmethod
    def allocate(self, search: Search) -> Proposal:
        """Search for the best allocation of ``search.instance``.

        Call ``search.submit`` with every improvement and ``search.should_stop()`` at least every 0.1 s. Increment
        ``search.iteration`` in each iteration. With a budget in iterations, the same ``search.seed`` and
        ``search.threads`` must give the same answer.

        Parameters
        ----------
        search : Search
            The run: instance, objective, seed, clock and best allocation so far.

        Returns
        -------
        Proposal
        """
