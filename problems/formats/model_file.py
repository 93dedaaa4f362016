"""Export of integer programmes as LP and MPS files."""

import re
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from alloc.problems.arguments import choice, of_type, real
from alloc.problems.errors import InputError
from alloc.problems.formats.files import PathLike, named, write_text_atomically
from alloc.problems.instance import Instance
from alloc.problems.models.comments import comments
from alloc.problems.models.programme import Programme, build_programme
from alloc.problems.vocabulary import ModelFormat, ModelKind, Objective

if TYPE_CHECKING:
    import highspy

COMMENT = {ModelFormat.LP: "\\", ModelFormat.MPS: "*"}
"""Prefix of comment lines."""

SMALLEST_COEFFICIENT = 1e-12
"""Coefficients below this are dropped; the least value that HiGHS allows for this option."""

SECTION = re.compile(r"^(bin|gen|semi)\n(?! )|^(bin|gen)(?=\n)", re.MULTILINE)
"""HiGHS's names of sections in LP files, even if empty; CBC mistakes them for variables."""

SPELT_OUT = {"bin": "binaries", "gen": "generals"}
"""Names of sections that all solvers accept; empty sections are left out."""


def write_model(
    instance: Instance,
    path: PathLike,
    *,
    format: ModelFormat | str | None = None,
    model: ModelKind | str = ModelKind.CLASS,
    objective: Objective | str = Objective.MAKESPAN,
    makespan: float | None = None,
) -> None:
    """Write the integer programme of an instance for any solver; `read_allocation` reads the solution.

    Parameters
    ----------
    instance : Instance
    path : str or path
        A file, or ``-`` for standard output.
    format : ModelFormat or str, optional
        ``lp`` or ``mps``; by default, determined by the suffix of `path`.
    model : ModelKind or str
        ``class`` counts interchangeable agents, which gives a smaller model; ``plain`` has a binary variable for each
        agent and task, e_ij of (5).
    objective : Objective or str
        Minimise the makespan, or with ``makespan-energy`` the energy at `makespan`.
    makespan : float, optional
        Deadline of all tasks, > 0; required for the energy, and with speeds.

    Raises
    ------
    InputError
        If an argument is invalid (`place` names the parameter), or the file cannot be written.
    RefusedError
        If the model has no solution, or would be too large.
    """
    of_type(instance, Instance, "instance")
    suffix = Path(named(path)).suffix.lower().removeprefix(".")
    if format is None and suffix not in list(ModelFormat):
        raise InputError(
            f"must be given, {' or '.join(ModelFormat)}, as the name of the file does not say it", "format"
        )
    kind = choice(ModelFormat, suffix if format is None else format, "format")
    programme = build_programme(
        instance,
        by_class=choice(ModelKind, model, "model") is ModelKind.CLASS,
        objective=choice(Objective, objective, "objective"),
        makespan=None if makespan is None else real(makespan, "makespan", above=True),
    )
    head = "".join(f"{COMMENT[kind]} {line}\n" for line in comments(programme))
    write_text_atomically(path, head + _written(programme, kind))


def _written(programme: Programme, kind: ModelFormat) -> str:
    """Return the programme in the format written by HiGHS."""
    import highspy

    highs = highspy.Highs()
    highs.setOptionValue("output_flag", False)
    highs.setOptionValue("small_matrix_value", SMALLEST_COEFFICIENT)
    highs.passModel(_highs_model(programme))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, f"model.{kind}")
        highs.writeModel(str(path))
        text = path.read_text("ascii")
    return text if kind is ModelFormat.MPS else SECTION.sub(lambda match: SPELT_OUT.get(match[0], ""), text)


def _highs_model(programme: Programme) -> "highspy.HighsLp":
    import highspy

    matrix, pairs = programme.matrix(), len(programme.kind)
    rows, columns = matrix.shape
    tasks, free = len(programme.tasks), columns - pairs
    size = programme.groups.count[programme.used].astype(float)
    model = highspy.HighsLp()
    model.num_col_, model.num_row_ = columns, rows
    model.col_names_, model.row_names_ = programme.column_names(), programme.row_names()
    model.sense_ = highspy.ObjSense.kMaximize if programme.is_free else highspy.ObjSense.kMinimize
    energy = np.zeros(pairs) if programme.energy is None else programme.energy
    model.col_cost_, model.col_lower_ = np.append(energy, np.ones(free)), np.zeros(columns)
    model.col_upper_ = np.append(programme.groups.count[programme.kind], np.ones(free)).astype(float)
    model.row_lower_ = np.append(np.zeros(tasks) if free else programme.need, np.full(len(size), -np.inf))
    model.row_upper_ = np.append(np.full(tasks, np.inf), size)
    model.a_matrix_.format_ = highspy.MatrixFormat.kColwise
    model.a_matrix_.start_, model.a_matrix_.index_ = matrix.indptr, matrix.indices
    model.a_matrix_.value_ = matrix.data
    kinds = highspy.HighsVarType
    model.integrality_ = [kinds.kInteger] * pairs + [kinds.kContinuous] * free
    return model
