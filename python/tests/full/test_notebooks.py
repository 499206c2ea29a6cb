"""The notebooks run from start to end, and show pictures where they are read.

With NEMORAL_BLESS=1 what they give is written into them.
"""

from __future__ import annotations

import base64
import io
import os
from pathlib import Path

import pytest

pytest.importorskip("nbclient", reason="nbclient is not installed")
import nbformat  # noqa: E402
from nbclient import NotebookClient  # noqa: E402
from PIL import Image  # noqa: E402

NOTEBOOKS = sorted((Path(__file__).parents[3] / "examples" / "notebooks").glob("*.ipynb"))


def pictures(notebook: nbformat.NotebookNode) -> int:
    """How many pictures the cells gave, none of which failed."""
    found = 0
    for cell in notebook.cells:
        for output in cell.get("outputs", []):
            assert output.output_type != "error", cell.source
            found += any(kind.startswith("image/") for kind in output.get("data", {}))
    return found


def smaller(data: dict[str, str]) -> None:
    """Keeps one form of an output, and pictures as JPEG where that is smaller."""
    if "image/png" not in data:
        return
    for kind in ("text/html", "text/plain"):
        data.pop(kind, None)
    packed = io.BytesIO()
    picture = Image.open(io.BytesIO(base64.b64decode(data["image/png"]))).convert("RGB")
    picture.save(packed, "JPEG", quality=85)
    found = base64.b64encode(packed.getvalue()).decode()
    if len(found) < len(data["image/png"]):
        del data["image/png"]
        data["image/jpeg"] = found


def test_there_are_notebooks() -> None:
    assert len(NOTEBOOKS) >= 5


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook(path: Path) -> None:
    notebook = nbformat.read(path, as_version=4)
    client = NotebookClient(
        notebook, timeout=600, record_timing=False, kernel_name="python3",
        resources={"metadata": {"path": str(path.parent)}},
    )
    client.execute()
    assert pictures(notebook) > 0
    if os.environ.get("NEMORAL_BLESS") == "1":
        for cell in notebook.cells:
            for output in cell.get("outputs", []):
                smaller(output.get("data", {}))
        notebook.metadata.pop("language_info", None)
        nbformat.write(notebook, path)


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_shows_what_it_gave(path: Path) -> None:
    notebook = nbformat.read(path, as_version=4)
    assert pictures(notebook) > 0
    code = [cell for cell in notebook.cells if cell.cell_type == "code"]
    assert all(cell.execution_count for cell in code)
