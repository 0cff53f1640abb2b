"""Simulations: arrays, contacts, events, views."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tangible

from conftest import ball


def test_a_bounce_is_that_of_the_formula(scene: dict[str, Any]) -> None:
    run = tangible.simulate(scene, certify=True)
    land = math.sqrt(2.0 / 9.81)
    speed = 0.8 * 9.81 * land
    rest = 0.6 - land
    assert run.status == "done" and run.message == ""
    assert run.final["ball/y"] == pytest.approx(0.1 + speed * rest - 0.5 * 9.81 * rest**2, abs=1e-12)
    assert run.times.shape == (61,) and run.poses.shape == (61, 1, 3) and run.twists.shape == (61, 1, 3)
    assert run["ball/y"][0] == 1.1
    assert run.events.kind == ["touch"] and run.events.bodies == [("ball", "floor")]
    assert run.events.time[0] == pytest.approx(land, abs=1e-12)
    hit = run.contacts.normal_impulse > 0
    assert run.contacts.normal_impulse[hit].sum() == pytest.approx(1.2 * (9.81 * land + speed))
    assert run.summary["events"] == 1
    assert run.certificate is not None and run.certificate["verdict"] == "trustworthy"


def test_parameters_and_sparse_records(scene: dict[str, Any]) -> None:
    run = tangible.simulate(scene, {"bodies/ball/position/y": 2.0}, every=25)
    assert list(run.times) == [0.0, 0.25, 0.5, 0.6]
    assert run["ball/y"][0] == 2.0
    with pytest.raises(KeyError, match="expected BODY/COMPONENT"):
        run["bal/y"]
    with pytest.raises(ValueError, match="every"):
        tangible.simulate(scene, every=0)


def test_a_run_that_ends_early_raises_or_returns() -> None:
    stiff = {
        "bodies": [{"name": "a", "mass": 1, "inertia": 1, "position": [1, 0]}],
        "joints": [{"name": "pin", "type": "revolute", "bodies": ["a", "world"], "anchor": [0, 0]}],
        "springs": [
            {"name": "s", "bodies": ["a", "world"], "anchors": [[1, 1], [3, 1]], "stiffness": 1e9, "rest_length": 1}
        ],
        "simulation": {"dt": 0.01, "duration": 10},
    }
    with pytest.raises(tangible.TangibleError, match="dt is too large"):
        tangible.simulate(stiff)
    run = tangible.simulate(stiff, on_failure="return")
    assert run.status == "diverged" and "dt is too large" in run.message
    assert 1 <= len(run.times) < 1001 and np.isfinite(run.poses).all()


def test_arrays_outlive_their_run(scene: dict[str, Any]) -> None:
    poses = tangible.simulate(scene).poses
    for _ in range(50):
        tangible.simulate(scene)
    assert poses[0, 0, 1] == 1.1 and np.isfinite(poses).all()


def test_the_view_is_a_page_of_its_own(scene: dict[str, Any], tmp_path: Path) -> None:
    run = tangible.simulate(scene)
    run.show(tmp_path / "view.html")
    page = (tmp_path / "view.html").read_text()
    assert page.startswith("<!DOCTYPE html>") and "http://" not in page.replace("http://www.w3.org", "")
    frame = run._repr_html_()
    assert frame.startswith("<iframe srcdoc=") and "&lt;canvas" in frame or "&lt;svg" in frame


def test_energies_and_margins_are_those_of_the_run(scene: dict[str, Any]) -> None:
    run = tangible.simulate(scene, certify=True)
    speed = np.hypot(run["ball/vx"], run["ball/vy"])
    inertia = 0.5 * 1.2 * 0.1**2
    kinetic = 0.5 * 1.2 * speed**2 + 0.5 * inertia * run["ball/omega"] ** 2
    assert run.energies[:, 0] == pytest.approx(kinetic)
    assert run.energies[:, 1] == pytest.approx(1.2 * 9.81 * run["ball/y"])
    assert run.certificate is not None and len(run.margins) == 60
    assert run.margins.min() == run.certificate["margin_min"]
    assert len(tangible.simulate(scene).margins) == 0


def test_plots_of_energies_contacts_and_margins() -> None:
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    run = tangible.simulate(ball("fixed"), certify=True)
    total = run.plot_energies().lines[2].get_ydata()
    assert total == pytest.approx(run.energies.sum(axis=1))
    contacts = run.plot_contacts().lines
    assert [line.get_label() for line in contacts] == ["ball on floor"]
    assert sum(contacts[0].get_ydata()) == pytest.approx(run.contacts.normal_impulse.sum())
    margins = run.plot_margins()
    assert margins.get_title() == "of the discrete map: trustworthy"
    assert min(margins.lines[0].get_ydata()) == pytest.approx(run.margins.min())
    with pytest.raises(ValueError, match="certify=True"):
        tangible.simulate(ball("fixed")).plot_margins()


def test_plots_have_a_curve_a_coordinate() -> None:
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    axes = tangible.simulate(ball("fixed")).plot("ball/y", "ball/vy")
    assert len(axes.lines) == 2 and axes.get_xlabel() == "time (s)"


@pytest.mark.parametrize("parameters", [None, {"bodies/ball/mass": 2.0}])
def test_a_trajectory_keeps_its_scene(scene: dict[str, Any], parameters: dict[str, float] | None) -> None:
    built = tangible.Scene(scene)
    run = tangible.simulate(built, parameters)
    before, text = run.html(), run.scene.to_json()
    for changed in (built, run.scene):
        changed.add_body("intruder", shape={"box": {"size": [1, 1]}}, mass=5, position=[0, 3])
        assert "intruder" in changed.to_json()
        assert run.html() == before and run._repr_html_().count("intruder") == 0
    again = tangible.simulate(tangible.Scene(scene), parameters)
    assert again.scene.to_json() == text and again.html() == before
    assert "intruder" in tangible.simulate(built).html()


def test_a_trajectory_of_a_file_keeps_what_it_has_read(scene: dict[str, Any], tmp_path: Path) -> None:
    (tmp_path / "push.csv").write_text("time,x,y\n0,1,0\n1,2,0\n")
    scene["forces"] = [{"name": "p", "body": "ball", "force": {"file": "push.csv"}}]
    built = tangible.Scene(scene, folder=tmp_path)
    run = tangible.simulate(built)
    before = run.html()
    (tmp_path / "push.csv").write_text("time,x,y\n0,-9,0\n1,-9,0\n")
    built.add_body("late", shape={"circle": {"radius": 0.1}}, mass=1, position=[9, 9])
    assert run.html() == before
