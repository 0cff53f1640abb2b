"""Problems from memory: scenes, tables and arrays become the files that the engine reads."""

from __future__ import annotations

import contextlib
import copy
import json
import os
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from . import _core
from ._plain import plain
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
        with self.open(_core.Fit) as core:
            yield core

    @contextlib.contextmanager
    def open(self, read: Callable[[str, str], Core]) -> Iterator[Core]:
        """What `read` makes of the text and name; files of memory exist as long as the context."""
        if not self.files:
            yield read(self.text, self.name)
            return
        with tempfile.TemporaryDirectory(prefix="tangible_") as folder:
            for file, text in self.files.items():
                (Path(folder) / file).write_text(text, encoding="utf-8")
            data = json.loads(self.text)
            _place(data, folder)
            try:
                yield read(json.dumps(data), self.name)
            except _core.TangibleError as error:
                message = str(error)
                for file, said in self.said.items():
                    message = message.replace(f"{folder}/{file}", said)
                raise _core.TangibleError(message) from None


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
    """Collects what stands in memory, as files of a problem."""

    def __init__(self) -> None:
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


def make(problem: Mapping[str, Any] | str | os.PathLike[str], folder: str | os.PathLike[str],
         initial: Mapping[str, float] | None) -> Problem:
    """A problem from a fit file, or from its JSON, in which scenes and tables may stand."""
    if isinstance(problem, Mapping):
        maker = Maker()
        data = plain(maker.run(dict(problem), None, ""), "fit")
        name = str(Path(folder) / "fit")
    else:
        maker = Maker()
        name = os.fspath(problem)
        text = text_of(name)
        if not initial:
            return Problem(text, name, {}, {})
        data = json.loads(text)
    for key, value in (initial or {}).items():
        for k, parameter in enumerate(data.get("parameters", [])):
            entry = {"name": parameter, "path": parameter} if isinstance(parameter, str) else parameter
            if entry.get("name", entry.get("path")) == key:
                data["parameters"][k] = {**entry, "initial": float(value)}
                break
        else:
            raise _core.TangibleError(f"initial: no parameter of the fit is named {key}")
    return Problem(json.dumps(data), name, maker.files, maker.said)


def _columns(table: Any, where: str) -> dict[str, NDArray[Any]]:
    """A dict of arrays, or a DataFrame whose index may be the time, as columns of one length."""
    if hasattr(table, "columns") and hasattr(table, "index"):
        if table.index.name == "time" and "time" not in table.columns:
            table = table.reset_index()
        table = {str(key): table[key].to_numpy() for key in table.columns}
    if not isinstance(table, Mapping):
        raise TypeError(f"{where}: expected a dict of arrays or a DataFrame, got {type(table).__name__}")
    columns = {str(key): np.asarray(value) for key, value in table.items()}
    if "time" not in columns or columns["time"].ndim != 1:
        raise ValueError(f"{where}: expected a column time, got {', '.join(columns) or 'none'}")
    rows = len(columns["time"])
    for key, column in columns.items():
        if column.ndim == 0:
            columns[key] = np.full(rows, column)
        elif column.shape != (rows,):
            raise ValueError(f"{where}: {key}: expected shape {(rows,)}, as time, got {column.shape}")
        if key not in (*_OWNERS, "relative_to", "event") and column.dtype.kind not in "fiu":
            try:
                columns[key] = np.array([np.nan if x is None else x for x in column], dtype=np.float64)
            except (TypeError, ValueError):
                raise TypeError(f"{where}: {key}: expected numbers, got {column.dtype}") from None
    if not np.isfinite(columns["time"]).all():
        raise ValueError(f"{where}: time: expected finite numbers")
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
    if not np.isfinite(columns["number"]).all():
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
        for owner in _OWNERS:
            if owner in columns:
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
) -> dict[str, Any]:
    """The JSON of a fit of a scene to tables."""
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
    problem: dict[str, Any] = {"scene": copy.copy(Scene.of(scene)), "parameters": list(parameters), **keys}
    if points:
        problem["points"] = dict(points)
    if recordings is None:
        problem["observations"] = [{"data": data, "sigma": sigma}]
        return problem
    if data is not None:
        raise TypeError("data: expected None beside recordings, which have the data, got both")
    named = recordings.items() if isinstance(recordings, Mapping) else (
        (f"recording {k}", item) for k, item in enumerate(recordings))
    problem["recordings"] = []
    for name, item in named:
        own = dict(item) if isinstance(item, Mapping) and "data" in item else {"data": item}
        entry = {"data": own.pop("data"), "sigma": own.pop("sigma", sigma)}
        problem["recordings"].append({"name": name, **own, "observations": [entry]})
    return problem
