"""Scenes: three ways to write one, and the errors."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
import tangible

from conftest import ball


def test_a_dict_a_file_and_keywords_are_the_same_scene(scene: dict[str, Any], tmp_path: Path) -> None:
    file = tmp_path / "scene.json"
    file.write_text(json.dumps(scene))
    built = tangible.Scene(name="ball", simulation=scene["simulation"])
    for body in scene["bodies"]:
        keys = {k: v for k, v in body.items() if k != "name"}
        built.add_body(body["name"], **keys)
    built.add_force("push", body="ball", force=[0, 0], torque=0)
    texts = {tangible.Scene(s).to_json() if s is not built else built.to_json() for s in (scene, file, built)}
    assert len(texts) == 1
    built.save(tmp_path / "again.json")
    assert tangible.Scene(tmp_path / "again.json").to_json() in texts


def test_a_mistake_is_one_line_with_its_place(scene: dict[str, Any], tmp_path: Path) -> None:
    scene["bodies"][0]["mass"] = -1
    with pytest.raises(tangible.TangibleError, match=r"^ball: /bodies/0/mass: expected a number > 0, got -1$"):
        tangible.simulate(scene)
    with pytest.raises(tangible.TangibleError, match="nothing.json"):
        tangible.Scene(tmp_path / "nothing.json")
    with pytest.raises(ValueError):  # TangibleError is one
        tangible.Scene(bodies=[{"name": "a"}]).to_json()


def test_parameters_have_values_units_and_places(scene: dict[str, Any]) -> None:
    read = tangible.Scene(scene)
    assert read.parameters()["bodies/ball/mass"] == 1.2
    assert read.units()["bodies/ball/mass"] == "kg"
    assert read["bodies/*/friction"] == 0.3
    changed = read.with_parameters({"bodies/ball/mass": 2.0, "bodies/*/friction": 0.1})
    assert changed["bodies/ball/mass"] == 2.0 and changed["bodies/floor/friction"] == 0.1
    assert read["bodies/ball/mass"] == 1.2
    with pytest.raises(tangible.TangibleError, match="expected a number > 0"):
        read.with_parameters({"bodies/ball/mass": -2.0})
    with pytest.raises(tangible.TangibleError, match="matches no number"):
        read["bodies/bal/mass"]


def test_what_is_given_is_not_changed(scene: dict[str, Any]) -> None:
    before = json.dumps(scene)
    built = tangible.Scene(scene, gravity=[0, -1])
    built.add_body("extra", mass=1, inertia=1, position=[5, 5])
    assert json.dumps(scene) == before
    assert built.to_dict()["gravity"] == [0, -1]
    assert tangible.Scene(scene).to_dict() == scene


@pytest.mark.parametrize("from_file", [False, True])
def test_settings_that_are_not_given_are_kept(from_file: bool, tmp_path: Path) -> None:
    scene = ball("event", dt=0.02, duration=1.0)
    (tmp_path / "ball.json").write_text(json.dumps(scene))
    given = tmp_path / "ball.json" if from_file else scene
    changed = tangible.Scene(given, simulation={"duration": 0.5})
    assert changed.to_dict()["simulation"] == {"dt": 0.02, "duration": 0.5, "stepping": "event"}
    assert tangible.simulate(changed).times[1] == 0.02
    # Those that are given replace the file's, also to what is no default; others are added.
    fixed = tangible.Scene(given, simulation={"stepping": "fixed", "recovery_speed": 0.5})
    assert fixed.to_dict()["simulation"] == {
        "dt": 0.02, "duration": 1.0, "stepping": "fixed", "recovery_speed": 0.5}
    assert scene["simulation"] == {"dt": 0.02, "duration": 1.0, "stepping": "event"}
    with pytest.raises(tangible.TangibleError, match="/simulation/durations"):
        tangible.Scene(given, simulation={"durations": 0.5}).to_json()
    # Other keys are replaced as a whole.
    assert tangible.Scene(given, gravity=[0, -1]).to_dict()["gravity"] == [0, -1]
    assert tangible.Scene(given, forces=[]).to_dict()["forces"] == []
    bare = {"bodies": scene["bodies"]}
    assert tangible.Scene(bare, simulation={"dt": 0.1}).to_dict()["simulation"] == {"dt": 0.1}
