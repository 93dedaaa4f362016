"""Convert the executed notebooks to Markdown pages, which `hooks.py` adds to the site."""

import base64
import json
from collections.abc import Iterator
from pathlib import Path
from typing import TypedDict


class Cell(TypedDict):
    """A cell of a notebook file."""

    cell_type: str
    source: list[str]
    outputs: list[dict[str, object]]


def page(path: Path) -> tuple[str, dict[str, bytes]]:
    """Return a notebook as Markdown, and its pictures by their names on the page."""
    pictures: dict[str, bytes] = {}
    parts: list[str] = []
    for cell in json.loads(path.read_text(encoding="utf-8"))["cells"]:
        if cell["cell_type"] == "markdown":
            parts.append("".join(cell["source"]))
            continue
        parts.append(fenced("python", "".join(cell["source"])))
        parts += outputs(cell, path.stem, pictures)
    heading, _, rest = "\n\n".join(parts).partition("\n")
    return f"{heading}\n\n[The notebook itself]({path.name}).\n{rest}\n", pictures


def outputs(cell: Cell, stem: str, pictures: dict[str, bytes]) -> Iterator[str]:
    """Yield the outputs of a cell as Markdown; add its pictures to `pictures`."""
    for output in cell["outputs"]:
        data = output.get("data", {})
        assert isinstance(data, dict)
        if "image/png" in data:
            name = f"{stem}-{len(pictures) + 1}.png"
            pictures[name] = base64.b64decode("".join(data["image/png"]))
            yield f"![Output of the cell above]({name})"
        else:
            text = output.get("text") or data.get("text/plain") or []
            assert isinstance(text, list)
            yield fenced("text", "".join(text))


def fenced(language: str, text: str) -> str:
    """Return text between fences."""
    return f"```{language}\n{text.rstrip()}\n```"
