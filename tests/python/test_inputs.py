"""Whatever numpy makes is read, and what cannot be read is said in clear words."""

from __future__ import annotations

import time
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tangible

from conftest import ball


@pytest.mark.parametrize(
    "keys",
    [
        {"position": np.array([0.0, 1.0])},
        {"mass": np.float32(2)},
        {"mass": np.int64(2)},
        {"mass": np.array(2.0)},
        {"mass": Fraction(1, 2)},
        {"static": np.bool_(False)},
        {"shape": {"polygon": {"vertices": np.array([[-1, -1], [1, -1], [0, 2]], dtype=np.float32)}}},
    ],
)
def test_numbers_of_numpy_are_numbers(keys: dict[str, Any]) -> None:
    plain = {"shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": (0, 0), **keys}
    built = tangible.Scene(simulation={"duration": np.float64(0.1)})
    built.add_body("a", **plain)
    from_dict = tangible.Scene(bodies=[{"name": "a", **plain}], simulation={"duration": 0.1})
    assert tangible.simulate(built).final == tangible.simulate(from_dict).final
    assert built.to_json() == from_dict.to_json()


@pytest.mark.parametrize(
    ("value", "said"),
    [
        (np.nan, "expected a finite number, got NaN"),
        (-np.inf, "expected a finite number, got -Infinity"),
        (1j, "expected a number, text, list or dict, got 1j"),
        ({1, 2}, "expected a number, text, list or dict, got {1, 2}"),
    ],
)
def test_what_is_no_number_is_said_at_its_place(value: Any, said: str) -> None:
    built = tangible.Scene(name="my ramp")
    built.add_body("b", mass=1, inertia=1, position=[0, 0])
    with pytest.raises(tangible.TangibleError) as caught:
        built.add_body("a", mass=value)
    assert str(caught.value) == f"my ramp: /bodies/1/mass: {said}"
    assert list(built.bodies) == ["b"]
    with pytest.raises(tangible.TangibleError, match="^scene: /gravity/1: "):
        tangible.Scene(gravity=np.array([0, value]) if isinstance(value, float) else [0, value])
    with pytest.raises(tangible.TangibleError, match="^my ramp: .*bodies/b/mass: "):
        built.with_parameters({"bodies/b/mass": value})


def test_names_stand_in_errors_and_in_repr(tmp_path: Path) -> None:
    assert repr(tangible.Scene(name="my ramp")) == "Scene('my ramp', bodies=[])"
    wrong = tangible.Scene(name="my ramp", bodies=[{"name": "a"}])
    assert repr(wrong) == "Scene('my ramp', bodies=['a'])"
    with pytest.raises(tangible.TangibleError, match="^my ramp: /bodies/0/mass"):
        wrong.to_json()
    tangible.Scene(ball()).save(tmp_path / "a.json")
    assert tangible.Scene(tmp_path / "a.json").name == str(tmp_path / "a.json")


def test_records_and_paths() -> None:
    steps = tangible.Rollout(ball(), records=np.arange(0, 61, 20))
    assert steps().shape == (4, 6)
    with pytest.raises(TypeError, match="records: expected whole numbers, got 0.5"):
        tangible.Rollout(ball(), records=[0.5])  # type: ignore[list-item]
    for empty in ([], np.arange(0)):
        with pytest.raises(ValueError, match="records: expected at least one step"):
            tangible.Rollout(ball(), records=empty)
    with pytest.raises(TypeError, match="parameters: expected a list of paths, got the text"):
        tangible.Rollout(ball(), "bodies/ball/mass")
    with pytest.raises(TypeError, match="controls: expected a list of paths, got the text"):
        tangible.Rollout(ball(), [], "forces/push/torque")
    with pytest.raises(TypeError, match="expected a list of paths, got 3 in it"):
        tangible.Rollout(ball(), [3])  # type: ignore[list-item]


def test_inputs_by_name() -> None:
    names = ["bodies/ball/mass", "bodies/ball/velocity/x"]
    rollout = tangible.Rollout(ball(), names, ["forces/push/force/x"], threads=1)
    assert np.array_equal(rollout({names[1]: 2.0}), rollout([1.2, 2.0]))
    rows = rollout({names[1]: np.array([1.0, 2.0])})
    assert np.array_equal(rows, rollout([[1.2, 1.0], [1.2, 2.0]]))
    start = rollout.default_initial_state
    start[0] = 0.3
    assert np.array_equal(rollout(None, {"ball/x": 0.3}), rollout(None, start))
    ramp = np.linspace(0, 1, 60)
    assert np.array_equal(rollout(None, None, {"forces/push/force/x": ramp}),
                          rollout(None, None, ramp[:, None]))
    assert np.array_equal(rollout(None, None, {"forces/push/force/x": 1.0}),
                          rollout(None, None, np.ones((60, 1))))
    two = rollout({}, None, {"forces/push/force/x": np.stack([ramp, -ramp])})
    assert two.shape == (2, 6) and np.array_equal(two[1], rollout(None, None, -ramp[:, None]))
    _, along = rollout.jvp(({}, None, None), ({names[1]: 1.0}, None, None))
    assert along == pytest.approx(rollout.jacobian().parameters[:, 1], rel=1e-12, abs=1e-12)
    _, pull = rollout.vjp({names[0]: 2.0})
    assert pull(np.ones(6))[0].shape == (2,)
    for wrong, said in [
        ({"parameters": {"bodies/ball/mas": 1.0}}, "parameters: expected one of bodies/ball/mass, "),
        ({"initial_state": {"x": 1.0}}, "initial_state: expected one of ball/x"),
        ({"controls": {"forces/push/force/x": ramp[:3]}}, r"expected shape \(60,\), got \(3,\)"),
        ({"parameters": {names[0]: [1.0, 2.0], names[1]: [1.0, 2.0, 3.0]}}, "one length"),
    ]:
        with pytest.raises(ValueError, match=said):
            rollout(**wrong)


def test_shapes_in_messages_are_those_of_the_caller() -> None:
    rollout = tangible.Rollout(ball(), ["bodies/ball/mass"], ["forces/push/force/x"])
    for wrong, said in [
        ({"parameters": [1.0, 2.0]}, "parameters: expected shape (1,), got (2,)"),
        ({"parameters": np.ones((4, 2))}, "parameters: expected shape (N, 1), got (4, 2)"),
        ({"initial_state": [0.0]}, "initial_state: expected shape (6,), got (1,)"),
        ({"controls": np.zeros((3, 1))}, "controls: expected shape (60, 1), got (3, 1)"),
    ]:
        with pytest.raises(ValueError) as caught:
            rollout(**wrong)
        assert str(caught.value) == said


def test_a_scene_of_a_scene(tmp_path: Path) -> None:
    built = tangible.Scene(ball())
    same, faster = tangible.Scene(built), tangible.Scene(built, simulation={"dt": 0.005})
    assert same.to_json() == built.to_json() and faster.core.num_steps == 120
    same.add_body("late", mass=1, inertia=1, position=[9, 9])
    assert "late" not in built.to_json()
    changed = built.with_parameters({"bodies/ball/mass": 3.0})
    assert tangible.Scene(changed, gravity=[0, -1])["bodies/ball/mass"] == 3.0
    built.save(tmp_path / "scene.json")
    read = tangible.Scene(tangible.Scene(tmp_path / "scene.json"), gravity=[0, -1])
    assert read["gravity/y"] == -1 and read["bodies/ball/mass"] == 1.2


def test_a_saved_scene_takes_its_signals_along(tmp_path: Path) -> None:
    here, there = tmp_path / "here", tmp_path / "there"
    here.mkdir()
    there.mkdir()
    (here / "push.csv").write_text("time,x,y\n0,1,0\n0.3,0.123456789012345678,-1\n")
    scene = ball()
    scene["forces"][0]["force"] = {"file": Path("push.csv")}
    built = tangible.Scene(scene, folder=here)
    built.save(there / "scene.json")
    expected = tangible.simulate(built).poses
    assert np.array_equal(tangible.simulate(there / "scene.json").poses, expected)
    # Arrays are signals too.
    scene["forces"][0]["force"] = {"time": np.array([0, 0.3]), "x": np.array([1, 0.123456789012345678]),
                                   "y": [0, -1]}
    assert np.array_equal(tangible.simulate(scene).poses, expected)


def test_what_is_masked_is_not_taken_for_a_number() -> None:
    one = np.ma.masked_array([1.2, 9e9], [False, True])
    rollout = tangible.Rollout(ball(), ["bodies/ball/mass"])
    with pytest.raises(ValueError, match="^parameters: expected numbers, got an array that masks some$"):
        rollout(one[1:])
    assert np.array_equal(rollout(one[:1]), rollout([1.2]))
    with pytest.raises(tangible.TangibleError, match="^scene: /gravity/1: expected a finite number, got NaN$"):
        tangible.Scene(gravity=one)


def test_adding_is_linear() -> None:
    """Eight hundred bodies took 1.6 s when each one copied those before it."""
    def seconds(count: int) -> float:
        built = tangible.Scene()
        start = time.process_time()
        for k in range(count):
            built.add_body(f"b{k}", shape={"circle": {"radius": 0.1}}, mass=1, position=[k, 0])
        return time.process_time() - start

    seconds(100)
    assert min(seconds(800) for _ in range(3)) < 0.2


def test_bodies_and_joints_to_look_at() -> None:
    built = tangible.Scene(ball())
    built.add_joint("pin", type="revolute", bodies=["ball", "world"], anchor=[0, 2], damping=0.5)
    assert built.bodies["ball"]["mass"] == 1.2 and built.bodies["ball"]["linear_damping"] == 0
    assert built.joints["pin"]["damping"] == 0.5 and list(built.forces) == ["push"]
    assert not built.springs
    with pytest.raises(TypeError):
        built.bodies["ball"]["mass"] = 2.0  # type: ignore[index]


def test_frames_go_by_the_names_of_their_columns() -> None:
    pandas = pytest.importorskip("pandas")
    masses = ["bodies/a/mass", "bodies/b/mass"]
    scene = tangible.Scene(simulation={"dt": 0.1, "duration": 1.0}, gravity=[0, 0])
    for name in "ab":
        scene.add_body(name, mass=1, inertia=1, position=[0, 0])
        scene.add_force(f"f{name}", body=name, force=[1, 0])
    rollout = tangible.Rollout(scene, masses)
    frame = pandas.DataFrame({"bodies/b/mass": [2.0, 4.0], "bodies/a/mass": [1.0, 1.0]})
    assert np.array_equal(rollout(frame), rollout([[1.0, 2.0], [1.0, 4.0]]))
    assert np.array_equal(rollout(frame.iloc[0]), rollout([1.0, 2.0]))
    with pytest.raises(ValueError, match="expected one of bodies/a/mass, bodies/b/mass, got 'foo'"):
        rollout(pandas.DataFrame({"foo": [1.0], "bodies/a/mass": [1.0]}))
    pushed = tangible.Rollout(scene, [], ["forces/fa/force/x", "forces/fb/force/x"])
    controls = pandas.DataFrame({"forces/fb/force/x": [2.0] * 10, "forces/fa/force/x": [1.0] * 10})
    assert np.array_equal(pushed(controls=controls), pushed(controls=np.tile([1.0, 2.0], (10, 1))))


def coasting(**keys: Any) -> tangible.Scene:
    scene = tangible.Scene(gravity=[0, 0], simulation={"dt": 0.1, "duration": 1, "stepping": "event"})
    scene.add_body("b", mass=1, inertia=1, position=[0, 0], velocity=[3, 0], **keys)
    return scene


def test_what_a_dict_of_the_state_leaves_is_as_the_parameters_make_it() -> None:
    rollout = tangible.Rollout(coasting(), ["bodies/b/velocity/x", "bodies/b/position/x"])
    given = {"b/y": 2.0}
    assert rollout([1, 5], given) == pytest.approx([6, 2, 0, 1, 0, 0], abs=1e-12)
    rows = rollout([[1, 5], [2, 6]], {"b/y": [2.0, 3.0]})
    assert rows[:, :4] == pytest.approx(np.array([[6, 2, 0, 1], [8, 3, 0, 2]]), abs=1e-12)
    jacobian = rollout.jacobian([1, 5], given)
    expected = np.zeros((6, 2))
    expected[0] = [1, 1]
    expected[3, 0] = 1
    assert jacobian.parameters == pytest.approx(expected, abs=1e-12)
    assert jacobian.certificate
    for smoothing in (None, tangible.Smoothing(everywhere=True)):
        kinks = "element" if smoothing is None else "smoothed"
        states, pull = rollout.vjp([[1, 5], [2, 6]], given, kinks=kinks, smoothing=smoothing)
        assert states[:, 0] == pytest.approx([6, 8])
        bars = np.zeros((2, 6))
        bars[:, 0] = [1, 2]
        assert pull(bars)[0] == pytest.approx(np.array([[1, 1], [2, 2]]), abs=1e-12)
    assert rollout.jvp(([1, 5], given, None), ([1, 0], None, None))[1] == pytest.approx(expected[:, 0])
    # What is given does not depend on the parameters.
    x = rollout.jacobian([1, 5], {"b/x": 0.0})
    assert x.states[0] == pytest.approx(1)
    assert x.parameters[0] == pytest.approx([1, 0])


def test_a_dict_of_values_is_no_list_of_paths() -> None:
    with pytest.raises(TypeError, match="values are given where it is called"):
        tangible.Rollout(coasting(), {"bodies/b/mass": 2.0})  # type: ignore[arg-type]
