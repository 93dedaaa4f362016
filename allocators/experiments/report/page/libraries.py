"""JavaScript libraries of a page, from Python packages: Vega-Lite for charts, DataTables for tables."""

from functools import cache
from importlib.util import find_spec
from pathlib import Path

from alloc.allocators.experiments.report.page.encode import compressed
from alloc.problems import MissingPackageError

NEEDED = {"jinja2": "Jinja2", "vl_convert": "vl-convert-python", "itables": "itables"}


def require_packages() -> None:
    """Raise a `MissingPackageError` if a package needed for pages is not installed."""
    missing = [name for module, name in NEEDED.items() if find_spec(module) is None]
    if missing:
        needed = " and ".join(missing)
        raise MissingPackageError(f"a report as a page needs {needed}; install with: pip install 'alloc-mrta[report]'")


@cache
def libraries() -> dict[str, str]:
    """Return the scripts of Vega-Lite and DataTables and the style of the latter, compressed, by element id."""
    import vl_convert

    spec = find_spec("itables")  # not imported, as that looks for data frames; only its files are used
    assert spec is not None
    assert spec.origin is not None
    folder = Path(spec.origin).parent / "html"
    parts = {"vega": vl_convert.javascript_bundle("window.vegaEmbed = vegaEmbed;")}
    parts |= {name: (folder / f"dt_bundle.{name}").read_text(encoding="utf-8") for name in ("js", "css")}
    return {f"library-{name}": compressed(text) for name, text in parts.items()}
