"""Problems from memory: scenes, tables and arrays become the files that the engine reads."""

from __future__ import annotations

import contextlib
import copy
import html
import json
import os
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from datetime import timedelta
from numbers import Complex, Real
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from . import _core
from ._plain import file_name, mapping, number, plain, said, unmasked
from ._scene import Scene

# Columns of an observation file that are no measured coordinate.
_OWNERS = ("body", "point", "joint", "contact")
_KEYS = ("time", *_OWNERS, "relative_to", "event", "number")

Core = TypeVar("Core")


class Problem:
    """The text of a problem's file, and of the files that exist in memory alone."""

    def __init__(self, text: str, name: str, files: dict[str, str], said: dict[str, str]) -> None:
        self.text = text
        self.name = name  # which places the files that it names
        self.files = files
        self.said = said  # how messages name the files

    @contextlib.contextmanager
    def read(self) -> Iterator[_core.Fit]:
        """The engine's fit; files of memory exist as long as the context."""
        with self.open(_core.Fit) as (core, _):
            yield core

    @contextlib.contextmanager
    def open(self, read: Callable[[str, str], Core]) -> Iterator[tuple[Core, Callable[[str], str]]]:
        """What `read` makes of the text and name, and the function that has a text name files of
        memory as messages do; they exist as long as the context."""
        if not self.files:
            yield read(self.text, self.name), str
            return
        with tempfile.TemporaryDirectory(prefix="tangible_") as folder:
            for file, text in self.files.items():
                (Path(folder) / file).write_text(text, encoding="utf-8")
            data = json.loads(self.text)
            _place(data, folder)

            def named(text: str) -> str:
                for file, said in self.said.items():
                    path = f"{folder}/{file}"
                    # In JSON and in a page some letters are written in other ways.
                    for before, after in ((path, said), (_in_json(path), _in_json(said)),
                                          (html.escape(path), html.escape(said))):
                        text = text.replace(before, after)
                return text

            try:
                yield read(json.dumps(data), self.name), named
            except _core.TangibleError as error:
                raise _core.TangibleError(named(str(error))) from None


def _in_json(text: str) -> str:
    return json.dumps(text)[1:-1]


def _place(data: dict[str, Any], folder: str) -> None:
    """Names the files of memory where they are."""
    for part in (data, *data.get("recordings", [])):
        if not isinstance(part, dict):
            continue
        entries = [*part.get("observations", []), part.get("initial")]
        for owner, key in [(part, "scene"), *((entry, "file") for entry in entries if isinstance(entry, dict))]:
            value = owner.get(key)
            if isinstance(value, str) and value.startswith("memory:"):
                owner[key] = os.path.join(folder, value[len("memory:") :])


class Maker:
    """Collects what stands in memory, as files of a problem.

    Args:
        labels: How messages name tables, by their places in the problem, where it is not by these.
    """

    def __init__(self, labels: Mapping[str, str] | None = None) -> None:
        self.labels = dict(labels or {})
        self.files: dict[str, str] = {}
        self.said: dict[str, str] = {}

    def add(self, kind: str, text: str, said: str) -> str:
        """The name with which the problem's text calls a file; messages call it `said`."""
        file = f"{kind}{len(self.files)}.{'json' if kind == 'scene' else 'csv'}"
        self.files[file] = text
        self.said[file] = said
        return f"memory:{file}"

    def run(self, part: dict[str, Any], scene: Scene | None, where: str) -> dict[str, Any]:
        """A fit file's part of a scene and observations, with files in the place of values."""
        made = dict(part)
        own = scene
        if isinstance(part.get("scene"), (Scene, Mapping)):
            own = Scene.of(part["scene"])
            made["scene"] = self.add("scene", own.core.to_whole_json(), own.name)
        points = part.get("points") or {}
        entries: list[Any] = []
        given = part.get("observations")
        for k, entry in enumerate(given if isinstance(given, Sequence) and not isinstance(given, str) else []):
            values = self._values(entry)
            if values is None:
                entries.append(entry)
                continue
            kept = {key: value for key, value in entry.items() if key not in ("data", *values)}
            table = entry["data"] if "data" in entry else values
            label = f"{where}observations/{k}"
            label = self.labels.get(label, label)
            for text in observation_files(table, own, list(points), label):
                entries.append({**kept, "file": self.add("observations", text, label)})
        if given is not None and entries:
            made["observations"] = entries
        if "recordings" in part and isinstance(part["recordings"], Sequence):
            made["recordings"] = [
                self.run(dict(item), own, f"{where}recordings/{k}/") if isinstance(item, Mapping) else item
                for k, item in enumerate(part["recordings"])
            ]
        return made

    @staticmethod
    def _values(entry: Any) -> dict[str, Any] | None:
        """Of an entry in memory the columns that stand in it; None of one that names a file."""
        if not isinstance(entry, Mapping) or "file" in entry:
            return None
        if "data" in entry:
            return {}
        if "time" not in entry:
            return None
        options = ("sigma", "unwrap", "sensor", "camera", "clock", "relative_to", "frame", "gravity")
        return {key: value for key, value in entry.items() if key not in options}


def text_of(name: str) -> str:
    """The text of a problem's file."""
    try:
        return Path(name).read_text(encoding="utf-8-sig")
    except OSError as error:
        raise _core.TangibleError(f"{name}: cannot be read: {error.strerror}") from None
    except UnicodeDecodeError:
        raise _core.TangibleError(f"{name}: cannot be read: expected UTF-8") from None


def object_of(text: str) -> dict[str, Any] | None:
    """The object that a problem's text is; None of another text, of which the engine says what is
    wrong."""
    try:
        data = json.loads(text)
    except ValueError:
        return None
    return data if isinstance(data, dict) else None


def make(problem: Mapping[str, Any] | str | os.PathLike[str], folder: str | os.PathLike[str],
         initial: Mapping[str, float] | None, labels: Mapping[str, str] | None = None) -> Problem:
    """A problem from a fit file, or from its JSON, in which scenes and tables may stand; `labels` as
    of a `Maker`."""
    maker = Maker(labels)
    if initial is not None:
        mapping(initial, "initial", "a dict {name: value}")
    if isinstance(problem, Mapping):
        data = plain(maker.run(dict(problem), None, ""), "fit")
        name = str(Path(file_name(folder, "folder", "a folder's name")) / "fit")
    else:
        name = file_name(problem, "problem", "a fit file or a dict of its JSON")
        text = text_of(name)
        given = object_of(text)
        if not initial or given is None:
            return Problem(text, name, {}, {})
        data = given
    for key, value in (initial or {}).items():
        known: list[str] = []
        for k, parameter in enumerate(data.get("parameters", [])):
            entry = {"name": parameter, "path": parameter} if isinstance(parameter, str) else parameter
            known.append(str(entry.get("name", entry.get("path"))))
            if known[-1] == key:
                data["parameters"][k] = {**entry, "initial": number(value, f"initial {key}")}
                break
        else:
            raise _core.TangibleError(
                f"initial: no parameter of the fit is named {key}; its parameters are: {', '.join(known)}"
            )
    return Problem(json.dumps(data), name, maker.files, maker.said)


def is_table(value: Any) -> bool:
    """Whether it is a DataFrame, or a dict with a column of times."""
    if hasattr(value, "columns") and hasattr(value, "index"):
        return True
    return isinstance(value, Mapping) and "time" in value and not is_table(value["time"])


def _seconds(column: NDArray[Any], where: str) -> NDArray[Any]:
    """Times in s; time differences, of numpy, pandas or Python, are converted."""
    if column.dtype.kind == "m":
        return np.asarray(column / np.timedelta64(1, "s"))
    if column.dtype.kind == "M":
        raise TypeError(f"{where}: expected s or time differences, got dates ({column.dtype}): subtract the first")
    if column.dtype.kind == "O" and any(isinstance(x, timedelta) for x in column.flat):
        return np.array([x.total_seconds() if isinstance(x, timedelta) else np.nan for x in column.flat])
    return column


def _array(values: Any) -> NDArray[Any]:
    """A column as an array, in which what is missing is NaN, or None among texts."""
    if hasattr(values, "isna") and hasattr(values, "to_numpy"):  # of pandas, with its own sign for it
        array, missing = values.to_numpy(), np.asarray(values.isna())
        if array.dtype.kind == "O" and missing.any():
            array = array.copy()
            array[missing] = None
        return np.asarray(array)
    return unmasked(values)


def _numbers(column: NDArray[Any], where: str) -> NDArray[np.float64]:
    """A column of real numbers as such; None is NaN."""
    kind = column.dtype.kind
    strange = [x for x in column.flat if isinstance(x, (bool, np.bool_)) or
               (isinstance(x, Complex) and not isinstance(x, Real))] if kind == "O" else []
    if kind in "bcmM" or strange:
        got = type(strange[0]).__name__ if strange else str(column.dtype)
        raise TypeError(f"{where}: expected real numbers, got {got}")
    try:
        numbers = np.array([np.nan if x is None else x for x in column.flat], dtype=np.float64)
    except (TypeError, ValueError):
        raise TypeError(f"{where}: expected numbers, got {column.dtype}") from None
    if np.isinf(numbers).any():
        raise ValueError(f"{where}: expected finite numbers, or NaN for what was not measured, got an infinite one")
    return numbers


def _columns(table: Any, where: str) -> dict[str, NDArray[Any]]:
    """A dict of arrays, or a DataFrame whose index may be the time, as columns of one length."""
    hint = ""
    if hasattr(table, "columns") and hasattr(table, "index"):
        if table.index.name == "time" and "time" not in table.columns:
            table = table.reset_index()
        elif table.index.name is None:
            hint = "; an index of times is one that is named: table.rename_axis(\"time\")"
        table = {str(key): table[key] for key in table.columns}
    if not isinstance(table, Mapping):
        raise TypeError(f"{where}: expected a dict of arrays or a DataFrame, got {type(table).__name__}")
    columns = {str(key): _array(value) for key, value in table.items()}
    if "time" not in columns or columns["time"].ndim != 1:
        raise ValueError(f"{where}: expected a column time, got {', '.join(columns) or 'none'}{hint}")
    rows = len(columns["time"])
    for key, column in columns.items():
        if column.ndim == 0:
            columns[key] = column = np.full(rows, column)
        elif column.shape != (rows,):
            raise ValueError(f"{where}: {key}: expected shape {(rows,)}, as time, got {column.shape}")
        if key == "time":
            column = _seconds(column, f"{where}: time")
        if key not in (*_OWNERS, "relative_to", "event"):
            columns[key] = _numbers(column, f"{where}: {key}")
    if not np.isfinite(columns["time"]).all():
        raise ValueError(f"{where}: time: expected finite numbers, got NaN")
    return columns


def _text(owner: str, names: Sequence[Any], columns: Mapping[str, NDArray[Any]], also: Sequence[str]) -> str:
    """An observation file: a row for each time at which anything was measured; NaN: nothing was."""
    measured = [key for key in columns if key not in _KEYS]
    rows = [",".join(["time", owner, *also, *measured])]
    for i, time in enumerate(columns["time"]):
        values = [float(columns[key][i]) for key in measured]
        if not all(np.isnan(value) for value in values):
            cells = ["" if np.isnan(value) else f"{value:.17g}" for value in values]
            rows.append(",".join([f"{float(time):.17g}", str(names[i]), *(str(columns[k][i]) for k in also), *cells]))
    return "\n".join(rows) + "\n"


def _events(columns: Mapping[str, NDArray[Any]], where: str) -> str:
    """A file of the times of events."""
    expected = ("time", "event", "number")
    if set(columns) != set(expected):
        raise ValueError(f"{where}: expected the columns {', '.join(expected)}, got {', '.join(columns)}")
    numbers = columns["number"]
    if not (np.isfinite(numbers) & (numbers == np.floor(numbers))).all():
        raise ValueError(f"{where}: number: expected 1, 2, ... for the first, second, ... event of its name")
    rows = [
        f"{float(time):.17g},{event},{int(number)}"
        for time, event, number in zip(*(columns[key] for key in expected))
    ]
    return "\n".join([",".join(expected), *rows]) + "\n"


def observation_files(table: Any, scene: Scene | None, points: Sequence[str], where: str) -> list[str]:
    """The text of observation files that hold a table.

    Long tables have a column `body`, `point`, `joint` or `contact` that names what a row is of; wide
    ones columns like "ball/x", "pin/fx" or "ball:floor/normal"; a table of one moving body needs
    neither. A table of events has the columns `time`, `event` and `number`.
    """
    columns = _columns(table, where)
    wide = [key for key in columns if "/" in key]
    if not wide:
        if "event" in columns:
            return [_events(columns, where)]
        also = [key for key in ("relative_to",) if key in columns]
        owners = [owner for owner in _OWNERS if owner in columns]
        if len(owners) > 1:
            raise ValueError(f"{where}: expected one column {', '.join(_OWNERS)}, got {', '.join(owners)}")
        for owner in owners:
            return [_text(owner, list(columns[owner]), columns, also)]
        moving = [
            name for name, body in (scene.bodies.items() if scene is not None else ())
            if not body.get("static") and not body.get("kinematic")
        ]
        if len(moving) != 1:
            raise ValueError(
                f"{where}: expected a column {', '.join(_OWNERS)} or event, or columns like ball/x, of a scene with "
                f"{len(moving)} moving bodies, got {', '.join(columns)}"
            )
        return [_text("body", moving * len(columns["time"]), columns, also)]
    texts = []
    other = [key for key in columns if "/" not in key and key != "time"]
    if other:
        raise ValueError(f"{where}: expected time and columns like ball/x, got {other[0]} beside {wide[0]}")
    owners = list(dict.fromkeys(key.rpartition("/")[0] for key in wide))
    for owner in owners:
        own = {key.rpartition("/")[2]: columns[key] for key in wide if key.rpartition("/")[0] == owner}
        kind = "point" if owner in points else "body"
        if kind == "body" and scene is not None and owner not in scene.bodies:
            kind = "joint" if owner in scene.joints else "contact" if ":" in owner else kind
        texts.append(_text(kind, [owner] * len(columns["time"]), {"time": columns["time"], **own}, []))
    return texts


def of_data(
    scene: Any,
    data: Any,
    parameters: Any,
    sigma: Any,
    points: Mapping[str, Any] | None,
    recordings: Any,
    keys: Mapping[str, Any],
) -> tuple[dict[str, Any], dict[str, str]]:
    """The JSON of a fit of a scene to tables, and how messages name these."""
    if sigma is None:
        raise TypeError("sigma: expected the standard deviation of what was measured, got None")
    if parameters is None:
        raise TypeError("parameters: expected paths of what is to be found, got None")
    if isinstance(parameters, str):
        raise TypeError(f"parameters: expected a list of paths, got the text {parameters!r}")
    if isinstance(parameters, Mapping):
        parameters = [
            {"name": name, **({} if isinstance(value, Mapping) and ("sets" in value or "path" in value)
                              else {"path": name}),
             **(value if isinstance(value, Mapping) else {"initial": value})}
            for name, value in parameters.items()
        ]
    if not isinstance(parameters, Iterable):
        raise TypeError(f"parameters: expected a list of paths, got {said(parameters)}")
    problem: dict[str, Any] = {
        "scene": copy.copy(Scene.of(scene, "problem")), "parameters": list(parameters), **keys
    }
    if points is not None:
        mapping(points, "points", "a dict {name: {\"body\": name, \"at\": [x, y]}}")
        problem.update({"points": dict(points)} if points else {})
    if recordings is None:
        problem["observations"] = [{"data": data, "sigma": sigma}]
        return problem, {"observations/0": "data"}
    if data is not None:
        raise TypeError("data: expected None beside recordings, which have the data, got both")
    problem["recordings"], labels = _recordings(recordings, sigma)
    return problem, labels


def _recordings(recordings: Any, sigma: Any) -> tuple[list[dict[str, Any]], dict[str, str]]:
    """The entries of several runs, and how messages name their tables."""
    if is_table(recordings):
        raise TypeError("recordings: expected a list of tables or a dict {name: table}, got one table: [table]")
    if isinstance(recordings, str) or not isinstance(recordings, Iterable):
        raise TypeError(
            f"recordings: expected a list of tables or a dict {{name: table}}, got {type(recordings).__name__}"
        )
    named = recordings.items() if isinstance(recordings, Mapping) else (
        (f"recording {k}", item) for k, item in enumerate(recordings))
    entries: list[dict[str, Any]] = []
    labels: dict[str, str] = {}
    for k, (name, item) in enumerate(named):
        labels[f"recordings/{k}/observations/0"] = f"recordings/{name if isinstance(recordings, Mapping) else k}"
        own = dict(item) if isinstance(item, Mapping) and "data" in item else {"data": item}
        entry = {"data": own.pop("data"), "sigma": own.pop("sigma", sigma)}
        entries.append({"name": name, **own, "observations": [entry]})
    return entries, labels
