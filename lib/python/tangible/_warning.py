"""Warnings: what the programs print on stderr about a run or fit that has ended well."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Iterable
from pathlib import Path

_HERE = str(Path(__file__).parent)


class TangibleWarning(UserWarning):
    """A result whose use needs care; `warnings.filterwarnings` turns it off or into an error."""


def warn(lines: Iterable[str]) -> None:
    """Warns of each line at the caller's own line, where Python's filter shows it once."""
    level = 2
    frame = sys._getframe(1)
    while frame.f_back is not None and frame.f_code.co_filename.startswith(_HERE):
        frame = frame.f_back
        level += 1
    for line in lines:
        warnings.warn(line, TangibleWarning, stacklevel=level)
