"""Logs of a training: a CSV line for each generation, and event files for TensorBoard."""

import sys
from dataclasses import dataclass
from pathlib import Path

import pytest

from alloc.allocators.learned.files.training_log import TrainingLog
from alloc.problems import InputError


@dataclass(frozen=True)
class Line:
    decisions: int
    cost: float


def test_lines_are_appended_to_the_history(tmp_path: Path) -> None:
    """The file is rewritten with the known history, and grows line by line."""
    path = tmp_path / "log.csv"
    path.write_text("what an interrupted run left")
    with TrainingLog(Line, path, None, [Line(10, 0.5)]) as log:
        log.append(Line(20, 0.25))
    assert path.read_text().split() == ["decisions,cost", "10,0.5", "20,0.25"]


@pytest.mark.needs("tensorboard")
def test_events_contain_every_column(tmp_path: Path) -> None:
    """TensorBoard shows each column by decisions; steps repeated by a resumed run appear once."""
    from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

    with TrainingLog(Line, tmp_path / "log.csv", tmp_path / "events", []) as log:
        log.append(Line(10, 0.5))
        log.append(Line(20, 0.25))
    with TrainingLog(Line, tmp_path / "log.csv", tmp_path / "events", [Line(10, 0.5)]) as log:
        log.append(Line(20, 0.125))
    events = EventAccumulator(str(tmp_path / "events")).Reload()
    assert [(event.step, event.value) for event in events.Scalars("training/cost")] == [(10, 0.5), (20, 0.125)]


def test_missing_tensorboard_names_the_extra(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The error says what to install, and nothing is written."""
    monkeypatch.setitem(sys.modules, "torch.utils.tensorboard", None)
    with pytest.raises(InputError, match=r"alloc-mrta\[train\]"):
        TrainingLog(Line, tmp_path / "log.csv", tmp_path / "events", [])
    assert not (tmp_path / "log.csv").exists()
