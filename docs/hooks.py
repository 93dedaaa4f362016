"""Hooks of `mkdocs`: additional pages, links, and a check that pages load nothing from the network."""

import posixpath
import re
import sys
from collections.abc import Mapping
from pathlib import Path

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "docs"))

import make_commands  # noqa: E402  (beside this file, which is no package)
import make_notebooks  # noqa: E402

PAGES_OUTSIDE = ("CONTRIBUTING.md", "CHANGELOG.md", "LICENSE", "CITATION.cff")
EXAMPLES = (".csv", ".ipynb", ".json", ".md", ".py", ".toml", ".txt", ".yaml")
"""Suffixes of the files in examples/ that pages may link to."""

LINK = re.compile(r"\[([^\[\]]*)\]\(([^)\s#:]+)(#[^)\s]*)?\)")
CODE = re.compile(r"(^```.*?^```$|^ {4}[^\n]*$|^#[^\n]*$)", re.MULTILINE | re.DOTALL)
"""Blocks of code, and headings."""

REFERENCE = ROOT / "docs" / "reference"

EXTERNAL = re.compile(
    r"<(?:script|img|iframe|source)\b[^>]*?\bsrc=[\"']?https?:|<link\b(?![^>]*\bcanonical)[^>]*?\bhref=[\"']?https?:"
)
"""HTML that makes a browser load something from another host; plain links do not."""


def on_config(config: MkDocsConfig) -> MkDocsConfig:
    """Add the pages of all public names to the navigation, grouped by the topics of the index."""
    chapters = (REFERENCE / "index.md").read_text(encoding="utf-8").split("\n## ")[1:]
    topics = [
        {chapter.partition("\n")[0]: [f"reference/{page}" for page in re.findall(r"\((\w+/\w+\.md)\)", chapter)]}
        for chapter in chapters
    ]
    (section,) = (one["Reference"] for one in config.nav if "Reference" in one)
    (entry,) = (one for one in section if "Python" in one)
    entry["Python"] = [entry["Python"], *topics]
    return config


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the page of all options, files of the repository outside docs/, and notebooks as pages."""
    files.append(File.generated(config, "use/commands.md", content=make_commands.page()))
    examples = [path for path in (ROOT / "examples").rglob("*") if path.suffix in EXAMPLES and is_kept(path)]
    for path in [*(ROOT / name for name in PAGES_OUTSIDE), *examples]:
        files.append(File.generated(config, path.relative_to(ROOT).as_posix(), abs_src_path=str(path)))
    for path in (ROOT / "examples" / "notebooks").glob("*.ipynb"):
        text, pictures = make_notebooks.page(path)
        for name, content in {f"{path.stem}.md": text, **pictures}.items():
            files.append(File.generated(config, f"examples/notebooks/{name}", content=content))
    return files


def is_kept(path: Path) -> bool:
    """Return whether a file belongs to the repository instead of being left over from a build or a run."""
    return not any(part in ("build", "__pycache__") or part.endswith(".egg-info") for part in path.parts)


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Adjust links to the site, and highlight commands, which have no prompt, as shell code."""
    if page.is_homepage:
        page.meta["hide"] = ["navigation"]  # it would have a single entry
    text = site_links(markdown, page.file.src_uri).replace("```console\n", "```bash\n")
    pages = {path.stem: path.relative_to(ROOT / "docs").as_posix() for path in REFERENCE.glob("*/*.md")}
    return reference_links(text, page.file.src_uri, pages)


def site_links(markdown: str, source: str) -> str:
    """Return the text of a page with links adjusted to the site, in which pages are named by their titles.

    Parameters
    ----------
    markdown : str
        The page; links are relative to its place in the repository.
    source : str
        Its place in the site.
    """
    is_made = source.startswith("examples/notebooks/")
    place = source if is_made or (ROOT / source).is_file() else f"docs/{source}"

    def lead(match: re.Match[str]) -> str:
        label, target = match[1], posixpath.normpath(posixpath.join(posixpath.dirname(place), match[2]))
        if label == posixpath.basename(target):
            label = title(ROOT / target)
        if (ROOT / target).is_dir():
            target = f"{target}/README.md" if (ROOT / target / "README.md").is_file() else "examples/README.md"
        if not is_made:
            target = re.sub(r"\.ipynb$", ".md", target)
        found = posixpath.relpath(target.removeprefix("docs/"), posixpath.dirname(source) or ".")
        return f"[{label}]({found}{match[3] or ''})"

    return LINK.sub(lead, markdown)


def title(path: Path) -> str:
    """Return the heading of a page, or the name of another file."""
    is_page = path.suffix == ".md" and path.is_file()  # mkdocs tells of links that lead nowhere
    heading = re.match(r"# (.+)", path.read_text(encoding="utf-8")) if is_page else None
    return heading[1] if heading else path.name


def reference_links(markdown: str, source: str, pages: Mapping[str, str]) -> str:
    """Return the text of a page in which classes of the Python reference are linked to their pages.

    In the reference itself functions are, too; elsewhere their names are often those of commands.
    """
    is_reference = source.startswith("reference/")
    found = {name: page for name, page in pages.items() if page != source and (is_reference or "/classes/" in page)}
    name = re.compile(rf"(?<![`\[\w])`({'|'.join(found)})`(?![`\]])")

    def lead(match: re.Match[str]) -> str:
        return f"[{match[0]}]({posixpath.relpath(found[match[1]], posixpath.dirname(source) or '.')})"

    parts = CODE.split(markdown)
    parts[::2] = [name.sub(lead, part) for part in parts[::2]]
    return "".join(parts)


def on_post_build(config: MkDocsConfig) -> None:
    """Raise an error if a page would load anything from the network."""
    for path in Path(config.site_dir).rglob("*.html"):
        found = EXTERNAL.search(path.read_text(encoding="utf-8"))
        if found:
            raise PluginError(f"{path} loads from the network: {found[0]}")
