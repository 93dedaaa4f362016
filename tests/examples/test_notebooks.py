"""The notebooks are stored executed, small, and without output that changes from run to run."""

import json
from pathlib import Path

import pytest

NOTEBOOKS = sorted((Path(__file__).parents[2] / "examples" / "notebooks").glob("*.ipynb"))
MAX_BYTES = 150_000


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.name)
def test_notebooks_are_stored_executed(path):
    """Every cell was run, in order, without an error, and the pictures are small."""
    cells = [cell for cell in json.loads(path.read_text("utf-8"))["cells"] if cell["cell_type"] == "code"]
    assert [cell["execution_count"] for cell in cells] == list(range(1, len(cells) + 1))
    kinds = {output["output_type"] for cell in cells for output in cell["outputs"]}
    assert "error" not in kinds
    assert "display_data" in kinds or "execute_result" in kinds
    assert path.stat().st_size <= MAX_BYTES


def test_there_are_two_notebooks():
    """One from own tables to a plan, one that compares methods and policies."""
    assert [path.name for path in NOTEBOOKS] == ["methods.ipynb", "own_data.ipynb"]
