"""Hooks of the site: the README is its first page; what docs link to lies in the site as well."""

from __future__ import annotations

import posixpath
import re
from pathlib import Path

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

ROOT = Path(__file__).resolve().parents[1]
REPOSITORY = "repository"
"""Folder of the site for files that lie outside of docs/."""
_LINK = re.compile(r"(\]\()(?!https?:|#)([^)#\s]+)")


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the README, and every file outside of docs/ that a page links to."""
    files.append(File.generated(config, "index.md", content=_readme()))
    pages = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
    todo = [found for page in pages for found in _outside(page)]
    seen: set[Path] = set()
    while todo:
        path = todo.pop()
        if path in seen or not path.is_file():
            continue
        seen.add(path)
        name = f"{REPOSITORY}/{path.relative_to(ROOT).as_posix()}"
        if path.suffix == ".md":
            text = path.read_text(encoding="utf-8")
            files.append(File.generated(config, name, content=text))
            todo += _outside(path)
        else:
            files.append(File.generated(config, name, abs_src_path=str(path)))
    return files


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Point links at where their files lie in the site."""
    del config
    here = posixpath.dirname(page.file.src_uri)

    def pointed(match: re.Match[str]) -> str:
        target = posixpath.normpath(posixpath.join(_source_folder(here), match[2]))
        found = _in_site(target, files)
        return f"{match[1]}{posixpath.relpath(found, here or '.')}" if found else match[0]

    return _LINK.sub(pointed, markdown)


def _readme() -> str:
    return (ROOT / "README.md").read_text(encoding="utf-8").replace("](docs/", "](../docs/")


def _source_folder(here: str) -> str:
    """The folder in the repository of a page's folder in the site."""
    if here == REPOSITORY or here.startswith(f"{REPOSITORY}/"):
        return here.removeprefix(REPOSITORY).lstrip("/")
    return posixpath.join("docs", here)


def _in_site(target: str, files: Files) -> str:
    """Where a file of the repository lies in the site; the nearest page for a folder."""
    inside = target.removeprefix("docs/")
    places = (inside, f"{REPOSITORY}/{target}", f"{REPOSITORY}/{target.removeprefix('docs/')}")
    return next((place for place in places if files.get_file_from_path(place)), "")


def _outside(page: Path) -> list[Path]:
    """Files that a page links to and that are no page of docs/."""
    linked = [(page.parent / match[2]).resolve() for match in _LINK.finditer(page.read_text())]
    docs = ROOT / "docs"
    return [path for path in linked if ROOT in path.parents and docs not in path.parents]
