"""Values of users as plain JSON and plain lists: numpy arrays and numbers are welcome anywhere."""

from __future__ import annotations

import math
import operator
import os
from collections.abc import Iterable, Mapping, Sequence
from numbers import Integral, Real
from typing import Any

import numpy as np

from . import _core


def _said(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."


def plain(value: Any, name: str, place: str = "") -> Any:
    """A copy of the value as JSON has it: arrays as lists, numbers of numpy as numbers.

    Raises:
        TangibleError: A value that JSON does not have, with its place.
    """
    if value is None or isinstance(value, (bool, str)):
        return value
    if isinstance(value, Mapping):
        for key in value:
            if not isinstance(key, str):
                raise _core.TangibleError(
                    f"{name}: {place or '/'}: expected keys of text, got {_said(key)}"
                )
        return {key: plain(item, name, f"{place}/{key}") for key, item in value.items()}
    if isinstance(value, (list, tuple, range)):
        return [plain(item, name, f"{place}/{i}") for i, item in enumerate(value)]
    if isinstance(value, np.bool_):
        return bool(value)
    if isinstance(value, Integral):
        return int(value)
    if isinstance(value, Real):
        number = float(value)
        if math.isfinite(number):
            return number
        said = "NaN" if math.isnan(number) else "Infinity" if number > 0 else "-Infinity"
        raise _core.TangibleError(f"{name}: {place}: expected a finite number, got {said}")
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    if hasattr(value, "__array__"):
        array = np.asarray(value)
        if array.dtype.kind in "biufUO" and not (array.ndim == 0 and array.dtype.kind == "O"):
            return plain(array.tolist(), name, place)
    raise _core.TangibleError(
        f"{name}: {place}: expected a number, text, list or dict, got {_said(value)}"
    )


def paths(values: Sequence[str], name: str) -> list[str]:
    """The paths as a list; one string alone, of which each letter would be a path, is refused."""
    if isinstance(values, str):
        raise TypeError(f"{name}: expected a list of paths, got the text {values!r}: [{values!r}]")
    found = list(values)
    for value in found:
        if not isinstance(value, str):
            raise TypeError(f"{name}: expected a list of paths, got {_said(value)} in it")
    return [str(value) for value in found]


def integers(values: Iterable[int], name: str) -> list[int]:
    """Whole numbers, of numpy too."""
    found = []
    for value in values:
        try:
            found.append(operator.index(value))
        except TypeError:
            raise TypeError(f"{name}: expected whole numbers, got {_said(value)}") from None
    return found
