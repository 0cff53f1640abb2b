"""The code of the READMEs prints what stands behind it."""

from __future__ import annotations

import contextlib
import io
import re
from pathlib import Path

import pytest

TOP = Path(__file__).resolve().parents[2]


@pytest.mark.parametrize("readme", ["README.md", "lib/python/README.md"])
def test_code_prints_its_comments(readme: str) -> None:
    blocks = re.findall(r"```python\n(.*?)```", (TOP / readme).read_text(encoding="utf-8"), re.DOTALL)
    assert blocks
    names: dict[str, object] = {}
    for block in blocks:
        expected = re.findall(r"^print\(.*\) +# (?:[^:\n]*: )?(.*)$", block, re.MULTILINE)
        assert expected
        output = io.StringIO()
        with contextlib.redirect_stdout(output):
            exec(compile(block, readme, "exec"), names)
        assert output.getvalue().splitlines() == expected
