"""The JSON Schemas that programs print say what the programs read."""

from __future__ import annotations

import copy
import json
import os
import pathlib
import subprocess
from typing import Any, Iterator

import jsonschema
import pytest

DATA = pathlib.Path(__file__).parents[2] / "data"
PROGRAMS = pathlib.Path(os.environ["TANGIBLE_PROGRAMS"])

SHAPES: list[dict[str, Any]] = [
    {"circle": {"radius": 1}},
    {"ellipse": {"radii": [1, 2]}},
    {"box": {"size": [1, 2]}},
    {"capsule": {"length": 1, "radius": 1}},
    {"polygon": {"vertices": [[-1, -1], [1, -1], [1, 1], [-1, 1]]}},
]
JOINTS: list[dict[str, Any]] = [
    {"type": "revolute", "anchor": [0, 0], "friction": 1, "kinetic_friction": 0.5, "stribeck_speed": 1},
    {"type": "prismatic", "anchor": [0, 0], "axis": [1, 0], "stiffness": 1, "rest_displacement": 0.1},
    {"type": "weld", "anchor": [0, 0]},
    {"type": "distance", "anchors": [[0, 0], [1, 0]]},
    {"type": "fixed_angle"},
]
SCENE: dict[str, Any] = {
    "gravity": [0, -1],
    "bodies": [
        {"name": f"b{i}", "shape": shape, "mass": 1, "position": [3 * i, 0]} for i, shape in enumerate(SHAPES)
    ]
    + [{"name": "floor", "static": True, "shape": {"half_plane": {"normal": [0, 1], "offset": -9}}}],
    "joints": [{"name": f"j{i}", "bodies": [f"b{i}", "world"], **joint} for i, joint in enumerate(JOINTS)]
    + [{"name": "c", "type": "coupling", "joints": ["j0", "j1"], "ratio": 2, "limits": [None, 0.1]}],
    "springs": [
        {"name": "s", "bodies": ["b0", "b1"], "anchors": [[0, 0], [1, 0]], "stiffness": 1, "rest_length": 1}
    ],
    "forces": [{"name": "f", "body": "b0", "force": [0, 0], "start": 0.1}],
    "pairs": [{"bodies": ["b0", "b1"], "friction": 0.1}],
    "simulation": {"stepping": "event", "dt": 0.1, "duration": 0.1},
}
FIT: dict[str, Any] = {
    "parameters": [
        {"path": "bodies/b0/mass", "prior": {"gaussian": {"mean": 1, "sigma": 1}}},
        {"name": "m", "sets": [{"path": "bodies/b1/mass", "scale": 1}], "initial": 1},
    ],
    "loss": {"huber": 1},
    "recordings": [
        {
            "name": "one",
            "scene": "scene.json",
            "points": {"tip": {"body": "b0"}},
            "sensors": {"s": {"sigma": 0.1}},
            "cameras": {"c": {"scale": 1, "aspect": 1.02, "radial": 0.02, "radial_length": 0.5}},
            "clocks": {"k": {"rate": 1}},
            "observations": [{"file": "seen.csv", "sigma": {"x": 0.1, "y": 0.1}}],
        }
    ],
}
CONTROL: dict[str, Any] = {
    "scene": "scene.json",
    "controls": [{"path": "forces/f/torque", "low": -1, "high": 1}],
    "cost": [{"point": {"body": "b0"}, "target": [0, 0]}],
    "surrogate": {"samples": 2},
    "mpc": {"duration": 0.1, "horizon": 0.1},
}
EXAMPLES = {"simulate": SCENE, "fit": FIT, "control": CONTROL}


def validator(program: str) -> Any:
    text = subprocess.run([PROGRAMS / f"tangible-{program}", "--schema"], capture_output=True, check=True).stdout
    schema = json.loads(text)
    jsonschema.Draft202012Validator.check_schema(schema)
    return jsonschema.Draft202012Validator(schema)


def objects(value: Any, place: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """The places of all objects in a document whose keys are given ones."""
    if isinstance(value, dict):
        # A sigma may also have the names of events.
        if not place or place[-1] not in ("points", "sensors", "cameras", "clocks", "sigma"):
            yield place
        for key, item in value.items():
            yield from objects(item, (*place, key))
    if isinstance(value, list):
        for i, item in enumerate(value):
            yield from objects(item, (*place, i))


def with_unknown_key(document: Any, place: tuple[Any, ...]) -> Any:
    changed = copy.deepcopy(document)
    target = changed
    for step in place:
        target = target[step]
    target["zzz"] = 1
    return changed


def kind_of(document: Any) -> str | None:
    if not isinstance(document, dict):
        return None
    if "parameters" in document and ("observations" in document or "recordings" in document):
        return "fit"
    if "controls" in document and "cost" in document:
        return "control"
    return "simulate" if isinstance(document.get("bodies"), list) else None


def test_files_of_data_satisfy_their_schemas() -> None:
    schemas = {program: validator(program) for program in EXAMPLES}
    count = dict.fromkeys(EXAMPLES, 0)
    for path in sorted(DATA.rglob("*.json")):
        document = json.loads(path.read_text())
        kind = kind_of(document)
        if kind is None:
            continue
        count[kind] += 1
        errors = [error.message for error in schemas[kind].iter_errors(document)]
        assert not errors, f"{path}: {errors}"
    assert min(count.values()) > 0, count


@pytest.mark.parametrize("program", EXAMPLES)
def test_keys_are_those_that_the_program_names(program: str, tmp_path: pathlib.Path) -> None:
    schema = validator(program)
    assert schema.is_valid(EXAMPLES[program])
    (tmp_path / "scene.json").write_text(json.dumps(SCENE))
    (tmp_path / "seen.csv").write_text("time,body,x,y\n0.1,b0,0,0\n")
    compared = 0
    for place in objects(EXAMPLES[program]):
        changed = with_unknown_key(EXAMPLES[program], place)
        assert not schema.is_valid(changed), place
        file = tmp_path / "file.json"
        file.write_text(json.dumps(changed))
        run = subprocess.run([PROGRAMS / f"tangible-{program}", file], capture_output=True, text=True)
        assert run.returncode == 1, (place, run.stderr)
        if "expected one of " not in run.stderr:
            continue
        said = run.stderr.split("expected one of ")[1].split(", got ")[0].split(", ")
        # Every key that the program names is one of the schema, and the other way round.
        keys = [found for found in properties_at(schema.schema, EXAMPLES[program], place)]
        assert sorted(said) in [sorted(k) for k in keys], (place, said, keys)
        compared += 1
    assert compared > 5


def properties_at(schema: Any, document: Any, place: tuple[Any, ...]) -> Iterator[list[str]]:
    """The keys that a schema allows at a place; several where it has alternatives."""
    for branch in schema.get("anyOf", []) + schema.get("oneOf", []):
        yield from properties_at(branch, document, place)
    if not place:
        if "properties" in schema:
            yield list(schema["properties"])
    elif isinstance(place[0], int):
        if "items" in schema:
            yield from properties_at(schema["items"], document[place[0]], place[1:])
    elif place[0] in schema.get("properties", {}):
        yield from properties_at(schema["properties"][place[0]], document[place[0]], place[1:])
    elif isinstance(schema.get("additionalProperties"), dict):
        yield from properties_at(schema["additionalProperties"], document[place[0]], place[1:])


@pytest.mark.parametrize(
    "place, value",
    [
        (("bodies", 0, "mass"), 0),
        (("bodies", 0, "restitution"), 1.5),
        (("bodies", 0, "friction"), -0.1),
        (("bodies", 0, "position"), [0]),
        (("bodies", 0, "name"), "a b"),
        (("joints", 0, "stribeck_speed"), 0),
        (("simulation", "stepping"), "events"),
        (("simulation", "max_events_per_step"), 1.5),
        (("gravity",), [0, "1"]),
    ],
)
def test_values_out_of_range_are_refused(place: tuple[Any, ...], value: Any) -> None:
    changed = copy.deepcopy(SCENE)
    target = changed
    for step in place[:-1]:
        target = target[step]
    target[place[-1]] = value
    assert not validator("simulate").is_valid(changed)


def test_what_a_moving_body_needs_a_static_one_does_not() -> None:
    schema = validator("simulate")
    for key in ("mass", "position"):
        changed = copy.deepcopy(SCENE)
        del changed["bodies"][0][key]
        assert not schema.is_valid(changed)
        changed["bodies"][0]["static"] = True
        assert schema.is_valid(changed)
