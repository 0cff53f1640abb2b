"""Certificates say what is wrong, where, and what to try; runs and fits warn."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tangible

from conftest import ball

FRICTION = "pairs/box:floor/friction"


def pushed_box(stepping: str = "event", force: float = 4.0) -> tangible.Scene:
    """A box on a floor that a force pushes; it slides where the friction is below 4 / 9.81."""
    scene = tangible.Scene(simulation={"stepping": stepping, "dt": 0.02, "duration": 1.0})
    scene.add_body("box", shape={"box": {"size": [0.2, 0.2]}}, mass=1, position=[0, 0.1])
    scene.add_body("floor", static=True, shape={"half_plane": {"normal": [0, 1], "offset": 0}})
    scene.add_pair("box", "floor", friction=0.6)
    scene.add_force("push", body="box", force=[force, 0])
    return scene


def test_a_kink_is_told_in_words() -> None:
    found = tangible.Rollout(pushed_box(), [FRICTION]).certificate([4.0 / 9.81])
    assert not found and found.kind == "near_kink" and not found.trustworthy
    assert found["verdict"].startswith("near a kink: kink of 50 rows at step 0")
    assert (found.step, found.time, found.bodies, found.joint) == (0, 0.0, ("box", "floor"), None)
    assert 'kinks="smoothed"' in found.advice
    assert "50 times" in str(found) and "rows" not in str(found) and found.advice in str(found)
    assert "box and floor" in found.words and "friction limit" in found.words


def test_what_can_be_trusted_names_no_place() -> None:
    for friction in (0.3, 0.6):
        found = tangible.Rollout(pushed_box(), [FRICTION]).certificate([friction])
        assert found and found.kind == "trustworthy" and found.advice == ""
        assert (found.step, found.time, found.bodies) == (None, None, ())
        assert repr(found) == "Certificate('trustworthy')" and str(found).startswith("trustworthy: ")


def test_the_discrete_map_is_a_kind() -> None:
    found = tangible.Rollout(ball("fixed"), ["bodies/ball/position/y"]).certificate()
    assert found.kind == "discrete_map" and not found
    # It falls 1 m, which takes 0.4515 s: an impact with restitution, in step 45.
    assert found.step in (44, 45) and found.time == pytest.approx(0.01 * found.step)
    assert found.bodies == ("ball", "floor") and '"stepping": "event"' in found.advice


def test_jumps_and_sides_are_kinds() -> None:
    fallen = np.sqrt(2.0 / 9.81)
    at_end = tangible.Rollout(ball("event", duration=fallen), ["bodies/ball/position/y"]).certificate()
    assert at_end.kind == "discontinuous" and at_end.bodies == ("ball", "floor")
    assert at_end.time == pytest.approx(fallen, abs=1e-5) and "jumps" in at_end.advice
    slides = pushed_box("fixed")
    side = tangible.Rollout(slides, [FRICTION]).certificate([0.0])
    assert side.kind == "one_sided" and side.bodies == ("box", "floor") and "one side" in side.advice
    worst = tangible.Certificate(
        verdict="of the discrete map: discontinuous: step 3, t = 0.5 s: low limit of joint a; near "
        "a kink: step 9, t = 2 s: contact of b and c", advice="x", discrete_map=True)
    assert (worst.kind, worst.step, worst.joint, worst.bodies) == ("discontinuous", 3, "a", ())
    assert worst.advice.startswith("x; ")


def stretched() -> dict[str, Any]:
    """A pendulum that steps of this length, without a correction, pull out of its joint."""
    return {
        "bodies": [{"name": "a", "mass": 1, "inertia": 1, "position": [1, 0]}],
        "joints": [{"name": "pin", "type": "revolute", "bodies": ["a", "world"], "anchor": [0, 0]}],
        "simulation": {"dt": 0.05, "duration": 20, "stepping": "fixed"},
    }


def test_runs_warn_where_programs_do() -> None:
    with pytest.warns(tangible.TangibleWarning, match="joint") as caught:
        run = tangible.simulate(stretched())
    assert [str(w.message) for w in caught] == run.warnings
    assert {Path(w.filename).name for w in caught} == {"test_certificate.py"}
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        tangible.simulate(ball())
    with warnings.catch_warnings(record=True) as seen:
        warnings.simplefilter("default")
        for _ in range(5):
            tangible.simulate(stretched())
    assert len(seen) == len(run.warnings)


def test_fits_warn_of_their_certificate() -> None:
    result = tangible.FitResult(
        {"status": "converged", "message": "", "parameters": [], "warnings": ["few data"],
         "certificate": {"verdict": "near a kink: margin 1e-9 at step 3, t = 0.1 s: contact of a and b",
                         "advice": "", "discrete_map": False, "margin_where": ""}}, "")
    assert result.warnings[0] == "few data"
    assert result.warnings[1].startswith("not trustworthy at the estimate: near a kink")


def test_what_fails_has_no_derivative_to_trust() -> None:
    scene = tangible.Scene(simulation={"dt": 0.01, "duration": 1.0})
    scene.add_body("b", mass=1, inertia=1, position=[0, 0], velocity=[1e300, 0], linear_damping=-0.0)
    scene.add_force("push", body="b", force=[1e308, 0])
    rollout = tangible.Rollout(scene, ["bodies/b/mass"])
    with pytest.raises(tangible.TangibleError):
        rollout([1e-3])
    found = rollout.certificate([1e-3])
    assert not found and found.kind == "discontinuous" and "the run fails" in found["verdict"]
    refused = rollout.certificates([[-1.0]])[0]
    assert not refused and "there is no run: bodies/b/mass: expected a number > 0" in refused["verdict"]


def test_a_state_that_is_read_at_an_event_is_named() -> None:
    scene = tangible.Scene(
        gravity=[0, -10], simulation={"stepping": "event", "dt": 0.05, "duration": 0.8}
    )
    scene.add_body(
        "ball", shape={"circle": {"radius": 0.5}}, mass=1, position=[0, 1.3], restitution=0.25
    )
    scene.add_body(
        "floor", static=True, restitution=0.25, shape={"half_plane": {"normal": [0, 1], "offset": 0}}
    )
    # It falls by 0.8 m in 0.4 s.
    for records, kind in (([7, 16], "trustworthy"), ([8], "discontinuous")):
        rollout = tangible.Rollout(scene, ["bodies/ball/position/y"], records=records)
        assert rollout.certificate().kind == kind, records
    table = tangible.Scene(
        gravity=[0, 0], simulation={"stepping": "event", "dt": 0.05, "duration": 1}
    )
    table.add_body(
        "block", mass=1, inertia=1, position=[0, 0], velocity=[1, 0], support={"friction": 0.2, "load": 10}
    )
    table.add_body("free", mass=1, inertia=1, position=[1, 1])
    table.add_force("push", body="free", force=[2, 0], end=0.25)
    # The block stops after 1 / 2 s.
    for path, record, kind in (
        ("bodies/block/velocity/x", 10, "near_kink"),
        ("forces/push/end", 5, "one_sided"),
    ):
        for records, expected in (([9, 20], "trustworthy"), ([record], kind)):
            found = tangible.Rollout(table, [path], records=records).certificate()
            assert found.kind == expected, (path, records)
