"""Notebooks are kept as they are typed: their outputs are made when the site is built."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
NOTEBOOKS = sorted((ROOT / "notebooks").glob("*.ipynb"))


def leftovers(notebook: dict) -> list[str]:
    """What a run has left in a notebook, as .pre-commit-config.yaml has nbstripout take it away."""
    code = [cell for cell in notebook["cells"] if cell["cell_type"] == "code"]
    return [
        *(f"output of {cell['id']}" for cell in code if cell["outputs"]),
        *(f"execution count of {cell['id']}" for cell in code if cell["execution_count"] is not None),
        *(f"metadata {key}" for key in notebook["metadata"] if key != "kernelspec"),
    ]


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.name)
def test_notebooks_hold_no_outputs(path):
    """Mended by `pre-commit run --all-files nbstripout`."""
    assert leftovers(json.loads(path.read_text(encoding="utf-8"))) == []


def test_leftovers_are_found():
    run = {"cell_type": "code", "id": "a", "outputs": [{"output_type": "stream"}], "execution_count": 3}
    notebook = {"cells": [run], "metadata": {"kernelspec": {}, "language_info": {}}}
    assert leftovers(notebook) == ["output of a", "execution count of a", "metadata language_info"]
