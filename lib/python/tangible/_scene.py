"""Scenes: what the user wrote, as JSON, and what the engine has read of it."""

from __future__ import annotations

import copy
import json
import os
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any, Union

from . import _core
from ._plain import file_name, mapping, plain, text, write_whole

SceneLike = Union["Scene", Mapping[str, Any], str, "os.PathLike[str]"]
_EXPECTED = "a Scene, a scene file or a dict of its JSON"


def _name_in(data: Mapping[str, Any]) -> str:
    name = data.get("name")
    return name if isinstance(name, str) and name else "scene"


def _names_file(data: Any) -> bool:
    """Whether a scene's JSON names a file of a signal anywhere."""
    if isinstance(data, Mapping):
        return "file" in data or any(_names_file(value) for value in data.values())
    return isinstance(data, list) and any(_names_file(value) for value in data)


class Scene:
    """A scene: bodies, joints, springs, forces, and how they are simulated.

    The keys, units and defaults are those of a scene file (README of `lib/scene`); a mistake raises
    `TangibleError` with one line that says where it is, what was expected and what was found.

    Args:
        scene: A file, the JSON of one as a dict, or another `Scene`, which is copied; absent: a
            scene without bodies. Numbers may be numpy's, and lists arrays.
        folder: Where files that a dict names (signals) are looked for; of a file or a `Scene` it is
            theirs.
        **keys: Top-level keys that replace those of `scene`: `name`, `gravity`, ...; of `simulation`
            those alone that are given, so that a file keeps its `stepping` and `dt` where a
            `duration` is given.
    """

    def __init__(
        self,
        scene: Scene | Mapping[str, Any] | str | os.PathLike[str] | None = None,
        *,
        folder: str | os.PathLike[str] = ".",
        **keys: Any,
    ) -> None:
        self._file = ""  # where it was read, which errors name
        self._folder = file_name(folder, "folder", "a folder's name")
        self._read: _core.Scene | None = None
        self._data: dict[str, Any] = {"bodies": []}
        if isinstance(scene, Scene):
            self._file, self._folder, self._read = scene._file, scene._folder, scene._read
            self._data = scene.to_dict() if keys else copy.deepcopy(scene._data)
        elif isinstance(scene, Mapping):
            self._data = plain(scene, _name_in(scene))
        elif scene is not None:
            self._file = file_name(scene, "scene", _EXPECTED)
            self._folder = str(Path(self._file).parent)
            self._read = _core.Scene.load(self._file)
            self._data = {}
            if keys:
                self._data = json.loads(Path(self._file).read_text(encoding="utf-8-sig"))
        if keys:
            for key, value in plain(keys, _name_in(keys)).items():
                before = self._data.get(key)
                if isinstance(before, Mapping) and isinstance(value, Mapping):
                    self._data[key] = {**before, **value}
                else:
                    self._data[key] = value
            self._read = None

    @property
    def name(self) -> str:
        """Its file, or else its own name, or else "scene": what errors begin with."""
        return self._file or _name_in(self._data)

    @staticmethod
    def of(scene: SceneLike, name: str = "scene") -> Scene:
        """The scene itself, or one made from a file's name or a dict; `name`: of the argument."""
        if isinstance(scene, Scene):
            return scene
        return Scene(scene if isinstance(scene, Mapping) else file_name(scene, name, _EXPECTED))

    @staticmethod
    def _of_core(core: _core.Scene) -> Scene:
        made = Scene()
        made._data = {}
        made._read = core
        return made

    def _copy(self) -> Scene:
        """The scene as it is now, whatever is added to this one later."""
        same = Scene.__new__(Scene)
        same._file = self._file
        same._folder = self._folder
        same._data = copy.deepcopy(self._data)
        same._read = self._read  # which never changes
        return same

    __copy__ = _copy

    def __deepcopy__(self, memo: dict[int, Any]) -> Scene:
        return self._copy()

    def __getstate__(self) -> dict[str, Any]:
        """What pickle keeps: the series of signals too, as their files may not be there later."""
        state = dict(self.__dict__)
        if _names_file(self._data):
            state["_read"] = self.core
            state["_data"] = {}
        return state

    def _add(self, kind: str, name: str | None, keys: dict[str, Any]) -> None:
        if not self._data:
            self._data = self.to_dict()
        entries = self._data.setdefault(kind, [])
        entry = {"name": name, **keys} if name is not None else keys
        entries.append(plain(entry, self.name, f"/{kind}/{len(entries)}"))
        self._read = None

    def add_body(self, name: str, **keys: Any) -> None:
        """Adds a body: `shape`, `mass` (kg), `position` (m), `angle` (rad), `velocity` (m/s), ..."""
        self._add("bodies", name, keys)

    def add_joint(self, name: str, **keys: Any) -> None:
        """Adds a joint: `type`, `bodies` (two names), `anchor` (m, world), `damping`, `effort`, ..."""
        self._add("joints", name, keys)

    def add_spring(self, name: str, **keys: Any) -> None:
        """Adds a spring: `bodies`, `anchors` (m, world), `stiffness` (N/m), `rest_length` (m), ..."""
        self._add("springs", name, keys)

    def add_force(self, name: str, **keys: Any) -> None:
        """Adds a force: `body`, `force` (N), `torque` (N m), `at` (m, body frame), `start`, `end`."""
        self._add("forces", name, keys)

    def add_pair(self, *bodies: str, **keys: Any) -> None:
        """Gives two bodies a `friction` and `restitution` of their own."""
        self._add("pairs", None, {"bodies": list(bodies), **keys})

    @property
    def core(self) -> _core.Scene:
        """What the engine has read; raises `TangibleError` where it cannot."""
        if self._read is None:
            self._read = _core.Scene.parse(json.dumps(self._data), self.name, self._folder)
        return self._read

    def to_dict(self) -> dict[str, Any]:
        """The scene's JSON; of one that was read from a file with all defaults written out."""
        if not self._data:
            data: dict[str, Any] = json.loads(self.core.to_json())
            return data
        return copy.deepcopy(self._data)

    def to_json(self) -> str:
        """The text of a scene file; reading it back gives the same bits."""
        return self.core.to_json()

    def save(self, file: str | os.PathLike[str]) -> None:
        """Writes a scene file, with the series of its signals: it can be read in any folder."""
        write_whole(file, self.core.to_whole_json() + "\n")

    def with_parameters(self, parameters: Mapping[str, float]) -> Scene:
        """The scene with other values of parameters: {path: value in SI units}.

        Raises:
            TangibleError: A path that the scene does not have, or a value that is not allowed.
            TypeError: What is no dict of numbers.
        """
        mapping(parameters, "parameters", "a dict {path: value}")
        changed = Scene.__new__(Scene)
        changed._file = self._file
        changed._folder = self._folder
        changed._data = {}
        values = [plain(value, self.name, path) for path, value in parameters.items()]
        for path, value in zip(parameters, values):
            text(path, "parameters", "paths of parameters")
            if isinstance(value, bool) or not isinstance(value, (int, float)):
                raise TypeError(f"parameters: {path}: expected a number, got {value!r}")
        changed._read = self.core.with_parameters(list(parameters), [float(v) for v in values])
        return changed

    def _items(self, kind: str) -> Mapping[str, Mapping[str, Any]]:
        read = json.loads(self.core.to_json()).get(kind, [])
        return MappingProxyType({item["name"]: MappingProxyType(item) for item in read})

    @property
    def bodies(self) -> Mapping[str, Mapping[str, Any]]:
        """The bodies to look at, {name: {key: value}}, with all defaults; to change one, change a
        parameter, or the dict of `to_dict`."""
        return self._items("bodies")

    @property
    def joints(self) -> Mapping[str, Mapping[str, Any]]:
        """The joints to look at, as `bodies`."""
        return self._items("joints")

    @property
    def springs(self) -> Mapping[str, Mapping[str, Any]]:
        """The springs to look at, as `bodies`."""
        return self._items("springs")

    @property
    def forces(self) -> Mapping[str, Mapping[str, Any]]:
        """The forces to look at, as `bodies`."""
        return self._items("forces")

    def parameters(self) -> dict[str, float]:
        """Every parameter that a path can name, with its value (SI)."""
        return {path: value for path, value, _ in self.core.parameters()}

    def units(self) -> dict[str, str]:
        """The unit of every parameter, "1" for numbers."""
        return {path: unit for path, _, unit in self.core.parameters()}

    def range(self, path: str) -> tuple[float, float]:
        """The range that a parameter's values may have: (0, inf) of a mass or a friction, (0, 1) of a
        restitution, (-inf, inf) of a position."""
        return self.core.range(text(path, "path", "the path of a parameter"))

    def __getitem__(self, path: str) -> float:
        """The value of a parameter; of several that match, of the first."""
        return self.core.value(text(path, "path", "the path of a parameter"))

    def __contains__(self, path: object) -> bool:
        """Whether the path is that of a parameter."""
        try:
            return isinstance(path, str) and self.core.value(path) is not None
        except _core.TangibleError:
            return False

    def __repr__(self) -> str:
        if not self._data:
            return f"Scene({self.name!r}, bodies={self.core.body_names})"
        bodies = self._data.get("bodies")  # which may be anything until it is read
        names = [
            str(body.get("name", "?")) if isinstance(body, Mapping) else "?"
            for body in (bodies if isinstance(bodies, list) else [])
        ]
        return f"Scene({self.name!r}, bodies={names})"
