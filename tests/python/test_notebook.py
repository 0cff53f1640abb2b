# SPDX-License-Identifier: Apache-2.0
"""A notebook, run as a user's: the animated view plays in it."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

import tangible

CELLS = [
    """
import tangible
scene = {"name": "ball", "bodies": [
    {"name": "ball", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [0, 1]},
    {"name": "floor", "static": True, "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
  "simulation": {"duration": 0.5, "stepping": "event"}}
run = tangible.simulate(scene)
run
""",
    "run.show()",
    'run.plot("ball/y")',
]


def test_cells_play_the_view(tmp_path: Path) -> None:
    """The view is in the outputs of the cells that end with a run or show it, the plot a picture."""
    cells = [
        {"cell_type": "code", "execution_count": None, "metadata": {}, "outputs": [],
         "source": source.strip()}
        for source in CELLS
    ]
    kernel = {"name": "python3", "display_name": "Python 3", "language": "python"}
    notebook = {"cells": cells, "metadata": {"kernelspec": kernel}, "nbformat": 4,
                "nbformat_minor": 5}
    (tmp_path / "ball.ipynb").write_text(json.dumps(notebook))
    environment = os.environ | {
        "JUPYTER_RUNTIME_DIR": str(tmp_path / "runtime"),
        "IPYTHONDIR": str(tmp_path / "ipython"),
        "MPLBACKEND": "module://matplotlib_inline.backend_inline",
    }
    subprocess.run(
        [sys.executable, "-m", "nbconvert", "--to", "notebook", "--execute", "ball.ipynb",
         "--output", "done.ipynb"],
        cwd=tmp_path, env=environment, check=True, timeout=300)
    done = json.loads((tmp_path / "done.ipynb").read_text())
    outputs = [cell["outputs"] for cell in done["cells"]]
    for played in outputs[:2]:
        page = "".join(played[0]["data"]["text/html"])
        assert page.startswith("<iframe srcdoc=") and "canvas" in page
    assert any("image/png" in output.get("data", {}) for output in outputs[2])


def test_outside_a_notebook_a_file_is_needed() -> None:
    """One line says so."""
    run = tangible.simulate(
        {"name": "body", "bodies": [
            {"name": "body", "mass": 1, "inertia": 1, "position": [0, 0]}],
         "simulation": {"duration": 0.01}})
    with pytest.raises(RuntimeError, match="expected a file outside of one, got none"):
        run.show()
