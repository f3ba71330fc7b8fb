"""Hooks of the site: addresses of the repository, the help of every verb, links to files outside docs/."""

import io
import os
import posixpath
import re
import sys
import tomllib
from contextlib import redirect_stdout, suppress
from pathlib import Path
from typing import Any
from unittest.mock import patch

ROOT = Path(__file__).resolve().parents[2]
_SEARCH = 'data-md-component="search" role="dialog"'
_CONTENTS = re.compile(
    r'(<a href="#([^"]+)" class="md-nav__link">(?:(?!</a>).)*</a>\s*<nav class="md-nav" aria-label=)"[^"]*"', re.DOTALL
)
_LINK = re.compile(r"\]\((?!\w+:|#)([^)\s]+)\)")


def on_config(config: Any) -> Any:
    """The repository's address from pyproject.toml. Not as `repo_url`: the theme would fetch its stars and releases."""
    urls = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["urls"]
    config.extra["repository"] = urls["Repository"]
    config.extra["social"] = [{"icon": "fontawesome/brands/git-alt", "link": urls["Repository"], "name": "Repository"}]
    return config


def on_page_markdown(markdown: str, page: Any, config: Any, files: Any) -> str:
    """Fill in the help of the verbs, and lead links that leave docs/ to the repository."""
    if "<!-- verbs -->" in markdown:
        markdown = markdown.replace("<!-- verbs -->", verbs())
    folder = posixpath.dirname(page.file.src_uri)

    def target(found: re.Match[str]) -> str:
        path = posixpath.normpath(posixpath.join("docs", folder, found[1]))
        if path.startswith("docs/"):
            return found[0]
        if not (ROOT / path.partition("#")[0]).exists():
            raise FileNotFoundError(f"{page.file.src_uri}: no {path}")
        return f"]({config.extra['repository']}/blob/main/{path})"

    return _LINK.sub(target, markdown)


def on_post_page(output: str, page: Any, config: Any) -> str:
    """Names for screen readers: one for the dialog of the search, and one of its own for each part of the contents."""
    output = output.replace(_SEARCH, f'{_SEARCH} aria-label="Search"')
    return _CONTENTS.sub(r'\1"Contents of \2"', output)


def verbs() -> str:
    """What `evslip VERB --help` prints, of every verb."""
    sys.path.insert(0, str(ROOT / "src"))
    from evslip.cli import VERBS, main

    parts = []
    with patch.dict(os.environ, {"COLUMNS": "84", "NO_COLOR": "1", "TERM": "dumb"}):
        for name in VERBS:
            said = io.StringIO()
            with patch.object(sys, "argv", ["evslip", name, "--help"]), redirect_stdout(said), suppress(SystemExit):
                main()
            parts.append(f"## {name}\n\n```text\n{said.getvalue().rstrip()}\n```\n")
    return "\n".join(parts)
