"""Public names of `alloc.problems` and `alloc.allocators`: documented, typed, and no others."""

import inspect
import subprocess
import sys
from collections.abc import Iterator
from types import ModuleType

import pytest

import alloc.allocators
import alloc.problems

PACKAGES = (alloc.problems, alloc.allocators)
VERBS = {
    "compare", "describe", "explain", "load", "method_parameters", "names", "pareto", "plot", "plot_convergence",
    "read_result", "solve", "train", "whatif", "write_result",
}  # fmt: skip
METHODS = {
    "A2c", "Auction", "CpSat", "Ddpg", "Dqn", "Gappo", "GappoLs", "GeneticAlgorithm", "Greedy", "Hedonic",
    "LocalSearch", "LpRound", "Milp", "Ppo",
}  # fmt: skip


def public(package: ModuleType) -> Iterator[tuple[str, object]]:
    """Yield the public objects of a package with their names, constants excepted."""
    for name in package.__all__:
        value = getattr(package, name)
        if inspect.isfunction(value) or inspect.isclass(value):
            yield f"{package.__name__}.{name}", value


def routines(package: ModuleType) -> Iterator[tuple[str, object]]:
    """Yield the public functions, and the public methods of public classes."""
    for name, value in public(package):
        if inspect.isfunction(value):
            yield name, value
        else:
            for key, member in vars(value).items():
                inner = getattr(member, "__func__", member)
                if inspect.isfunction(inner) and not key.startswith("_"):
                    yield f"{name}.{key}", inner


@pytest.mark.parametrize("package", PACKAGES, ids=lambda package: package.__name__)
def test_public_objects_are_documented(package: ModuleType) -> None:
    """Each object has a docstring; each function describes its parameters and what it returns."""
    gaps = []
    for name, value in {**dict(public(package)), **dict(routines(package))}.items():
        text = inspect.getdoc(value) or ""
        if not text:
            gaps.append(f"{name}: no docstring")
        elif inspect.isfunction(value) and name.count(".") == 2:
            signature = inspect.signature(value)
            if signature.parameters and "Parameters\n-----" not in text:
                gaps.append(f"{name}: no Parameters")
            told = text.startswith("Return ") or "Returns\n-----" in text
            if signature.return_annotation is not None and not told:
                gaps.append(f"{name}: no Returns")
    assert gaps == []


@pytest.mark.parametrize("package", PACKAGES, ids=lambda package: package.__name__)
def test_public_functions_are_typed(package: ModuleType) -> None:
    """Each parameter and each return value of each function and method has a type."""
    gaps = []
    for name, value in routines(package):
        signature = inspect.signature(value)
        parameters = [one for one in signature.parameters.values() if one.name not in ("self", "cls")]
        if signature.return_annotation is inspect.Signature.empty:
            gaps.append(f"{name}: return value")
        gaps += [f"{name}: {one.name}" for one in parameters if one.annotation is inspect.Parameter.empty]
    assert gaps == []


def test_main_functions_and_methods_are_public() -> None:
    """What users need is public, including the class of every built-in method."""
    assert set(alloc.allocators.__all__) >= VERBS | METHODS
    classes = {target.partition(":")[2] for target in alloc.allocators.registry.TARGETS.values()}
    assert classes == METHODS
    assert set(dir(alloc.allocators)) >= set(alloc.allocators.__all__)
    with pytest.raises(AttributeError, match="no_such_name"):
        _ = alloc.allocators.no_such_name


@pytest.mark.parametrize(
    ("statement", "kind"),
    [
        ("from alloc.allocators import solve, pareto, explain; import alloc.allocators.solve", "function"),
        ("import alloc.allocators.pareto, alloc.allocators.explain; from alloc.allocators import explain", "function"),
    ],
)
def test_functions_are_not_shadowed_by_modules(statement: str, kind: str) -> None:
    """`solve`, `pareto` and `explain` are functions, whichever of module and function is imported first."""
    code = f"import alloc.allocators; {statement}; print(*(type(getattr(alloc.allocators, name)).__name__ for name in "
    code += "('solve', 'pareto', 'explain')))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == [kind] * 3
