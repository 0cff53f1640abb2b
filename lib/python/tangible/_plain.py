"""Values of users as plain JSON and plain lists: numpy arrays and numbers are welcome anywhere."""

from __future__ import annotations

import math
import operator
import os
from collections.abc import Iterable, Mapping, Sequence
from numbers import Integral, Real
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import _core


def said(value: object) -> str:
    """How messages show a value: on one line, and not at length."""
    text = " ".join(repr(value).split())
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
                    f"{name}: {place or '/'}: expected keys of text, got {said(key)}"
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
        got = "NaN" if math.isnan(number) else "Infinity" if number > 0 else "-Infinity"
        raise _core.TangibleError(f"{name}: {place}: expected a finite number, got {got}")
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    if hasattr(value, "__array__"):
        array = unmasked(value)
        if array.dtype.kind in "biufUO" and not (array.ndim == 0 and array.dtype.kind == "O"):
            return plain(array.tolist(), name, place)
    raise _core.TangibleError(
        f"{name}: {place}: expected a number, text, list or dict, got {said(value)}"
    )


def masked(values: Any) -> NDArray[np.bool_] | None:
    """What a masked array masks; None of other arrays, and where nothing is masked."""
    if not isinstance(values, np.ma.MaskedArray):
        return None
    mask: Any = values.mask
    spread = np.broadcast_to(np.asarray(mask, dtype=np.bool_), values.shape)
    return spread if spread.any() else None


def unmasked(values: Any) -> NDArray[Any]:
    """The values as an array; what a masked array masks is NaN, as nothing is known of it."""
    mask = masked(values)
    if mask is None:
        return np.asarray(values)
    array = np.array(values.data, dtype=np.float64 if values.dtype.kind in "fiu" else object)
    array[mask] = math.nan
    return array


def named(values: Any) -> Mapping[str, Any] | None:
    """The columns of a DataFrame, or the values of a Series, by their names, where these are texts;
    None of anything else. pandas is not imported for that."""
    labels = getattr(values, "columns", None)
    if labels is None:
        labels = getattr(values, "index", None)
    if labels is None or callable(labels) or not hasattr(values, "to_numpy"):
        return None
    if not all(isinstance(label, str) for label in labels):
        return None
    return {str(label): np.asarray(values[label]) for label in labels}


def paths(values: Sequence[str], name: str) -> list[str]:
    """The paths as a list; one string alone, of which each letter would be a path, is refused."""
    if isinstance(values, str):
        raise TypeError(f"{name}: expected a list of paths, got the text {values!r}: [{values!r}]")
    if isinstance(values, Mapping):
        # Whose values would be dropped.
        raise TypeError(
            f"{name}: expected a list of paths, got {said(values)}: values are given where it is called"
        )
    if not isinstance(values, Iterable):
        raise TypeError(f"{name}: expected a list of paths, got {said(values)}")
    found = list(values)
    for value in found:
        if not isinstance(value, str):
            raise TypeError(f"{name}: expected a list of paths, got {said(value)} in it")
    return [str(value) for value in found]


def integers(values: Iterable[int], name: str) -> list[int]:
    """Whole numbers, of numpy too."""
    if not isinstance(values, Iterable):
        raise TypeError(f"{name}: expected a list of whole numbers, got {said(values)}")
    found = []
    for value in values:
        try:
            if isinstance(value, (bool, np.bool_)):
                raise TypeError
            found.append(operator.index(value))
        except TypeError:
            raise TypeError(f"{name}: expected whole numbers, got {said(value)}") from None
    return found


# Arguments of public functions: each helper returns the argument, or raises TypeError or ValueError
# with one line that says which, what was expected and what was found.


def whole(value: Any, name: str, low: int = 0, high: int = 2**31 - 1, *, what: str = "") -> int:
    """A whole number from `low` to `high`, of numpy too; True and 2.0 are none."""
    limits = f">= {low}" if high == 2**31 - 1 else f"from {low} to {high}"
    what = what or f"a whole number {limits}"
    if isinstance(value, (bool, np.bool_)) or not isinstance(value, Integral):
        raise TypeError(f"{name}: expected {what}, got {said(value)}")
    found = int(value)
    if found > high and str(high) not in what:
        what = f"at most {high}"
    if not low <= found <= high:
        raise ValueError(f"{name}: expected {what}, got {said(found)}")
    return found


def seed_of(value: Any) -> int:
    """A seed of numpy's generators."""
    return whole(value, "seed", 0, 2**128 - 1, what="a whole number >= 0")


def number(
    value: Any, name: str, low: float = -math.inf, *, above: float = -math.inf, what: str = "a finite number"
) -> float:
    """A finite number >= `low` and > `above`, of numpy too; True is none."""
    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value[()]
    if isinstance(value, (bool, np.bool_)) or not isinstance(value, Real):
        raise TypeError(f"{name}: expected {what}, got {said(value)}")
    found = float(value)
    if not math.isfinite(found) or found < low or found <= above:
        raise ValueError(f"{name}: expected {what}, got {'NaN' if math.isnan(found) else value}")
    return found


def flag(value: Any, name: str) -> bool:
    """True or False, of numpy too."""
    if not isinstance(value, (bool, np.bool_)):
        raise TypeError(f"{name}: expected True or False, got {said(value)}")
    return bool(value)


def choice(value: Any, name: str, *choices: str) -> None:
    """Refuses what is none of the words."""
    if not isinstance(value, str) or value not in choices:
        words = f"{', '.join(choices[:-1])} or {choices[-1]}"
        raise ValueError(f"{name}: expected {words}, got {value if isinstance(value, str) else said(value)}")


def function(value: Any, name: str) -> None:
    """Refuses what is neither None nor can be called."""
    if value is not None and not callable(value):
        raise TypeError(f"{name}: expected a function or None, got {said(value)}")


def text(value: Any, name: str, what: str) -> str:
    """A text."""
    if not isinstance(value, str):
        raise TypeError(f"{name}: expected {what}, got {said(value)}")
    return value


def mapping(value: Any, name: str, what: str) -> None:
    """Refuses what is no dict."""
    if not isinstance(value, Mapping):
        raise TypeError(f"{name}: expected {what}, got {type(value).__name__}")


def file_name(value: Any, name: str, what: str = "a file's name") -> str:
    """The name of a file or folder."""
    found = os.fspath(value) if isinstance(value, (str, os.PathLike)) else None
    if not isinstance(found, str):
        raise TypeError(f"{name}: expected {what}, got {type(value).__name__}")
    return found


def write_whole(file: Any, content: str) -> None:
    """Writes a text file; what was there stays until the new one is complete."""
    name = file_name(file, "file")
    if os.path.exists(name) and not os.path.isfile(name):  # a pipe, or the terminal
        Path(name).write_text(content, encoding="utf-8")
        return
    beside = f"{os.path.realpath(name)}.{os.getpid()}.tmp"
    try:
        Path(beside).write_text(content, encoding="utf-8")
        os.replace(beside, os.path.realpath(name))
    except OSError as error:
        raise OSError(error.errno, error.strerror, name) from None
    finally:
        Path(beside).unlink(missing_ok=True)
