"""Notebooks run without Jupyter: each cell of code in one namespace, its text and pictures as the cell's output.

python tests/helpers/notebooks.py NOTEBOOK FOLDER runs it in a folder and writes what it shows into it.
"""

import ast
import base64
import contextlib
import io
import json
import os
import sys
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure
from PIL import Image


def run(notebook: Path, folder: Path) -> list[list[dict[str, Any]]]:
    """Outputs of every cell of code, run in a folder, with the notebook's own folder on Python's path."""
    names: dict[str, Any] = {"__name__": "__main__"}
    cells, before = _cells(json.loads(notebook.read_text())), Path.cwd()
    home = str(notebook.parent.resolve())
    sys.path.insert(0, home)
    os.chdir(folder)
    try:
        return [_outputs("".join(cell["source"]), names) for cell in cells]
    finally:
        os.chdir(before)
        sys.path.remove(home)


def _cells(content: dict[str, Any]) -> list[dict[str, Any]]:
    return [cell for cell in content["cells"] if cell["cell_type"] == "code"]


def _outputs(source: str, names: dict[str, Any]) -> list[dict[str, Any]]:
    """What a cell prints, and the value of its last line, as nbformat's outputs."""
    tree, text = ast.parse(source), io.StringIO()
    last = ast.Expression(tree.body.pop().value) if tree.body and isinstance(tree.body[-1], ast.Expr) else None
    with contextlib.redirect_stdout(text):
        exec(compile(tree, "<cell>", "exec"), names)
        value = None if last is None else eval(compile(last, "<cell>", "eval"), names)
    found: list[dict[str, Any]] = []
    if text.getvalue():
        found.append({"output_type": "stream", "name": "stdout", "text": text.getvalue().splitlines(True)})
    if value is not None:
        shown = {"output_type": "execute_result", "data": _shown(value), "metadata": {}, "execution_count": None}
        found.append(shown)
    return found


def _shown(value: Any) -> dict[str, Any]:
    picture = io.BytesIO()
    if isinstance(value, Figure):
        value.savefig(picture, format="png", dpi=80)
    elif isinstance(value, Image.Image):
        value.save(picture, "PNG")
    else:
        return {"text/plain": repr(value).splitlines(True)}
    return {"image/png": base64.b64encode(picture.getvalue()).decode(), "text/plain": [f"<{type(value).__name__}>"]}


def main(notebook: Path, folder: Path) -> None:
    content = json.loads(notebook.read_text())
    for cell, outputs in zip(_cells(content), run(notebook, folder), strict=True):
        cell["outputs"] = outputs
    notebook.write_text(json.dumps(content, indent=1, ensure_ascii=False) + "\n")


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
