"""`python -m tangible FILE` does the programs' work, and the scenes that the package brings along run."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest
import tangible
from tangible.__main__ import main

from conftest import ball

DATA = Path(__file__).resolve().parents[2] / "data"
BALL = str(DATA / "scenes" / "bouncing_ball.json")
VELOCITY = "bodies/ball/velocity/x"
PACKAGE = Path(__file__).resolve().parents[2] / "lib" / "python"


@pytest.fixture
def fit_file(tmp_path: Path) -> str:
    """How fast a ball flies, seen at some times."""
    motion = tangible.simulate(ball(), every=5)
    rows = [f"{t:.17g},ball,{x:.17g}" for t, x in zip(motion.times, motion["ball/x"] + 1e-3 * np.sin(9 * motion.times))]
    (tmp_path / "seen.csv").write_text("\n".join(["time,body,x", *rows]))
    (tmp_path / "scene.json").write_text(json.dumps(ball()))
    file = tmp_path / "fit.json"
    file.write_text(json.dumps({
        "scene": "scene.json", "observations": [{"file": "seen.csv", "sigma": 0.001}],
        "parameters": [{"path": VELOCITY, "initial": 0.4}]}))
    return str(file)


@pytest.fixture
def plan_file(tmp_path: Path) -> str:
    """A ball that is pushed to a mark in the air."""
    (tmp_path / "scene.json").write_text(json.dumps(ball(duration=0.2)))
    file = tmp_path / "plan.json"
    file.write_text(json.dumps({
        "scene": "scene.json", "controls": [{"path": "forces/push/force/x", "low": -9, "high": 9}],
        "cost": [{"control": "forces/push/force/x"}, {"state": "ball/x", "target": 0.2, "weight": 1e4, "at": "end"}]}))
    return str(file)


def run(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "tangible", *arguments], capture_output=True, text=True, env=dict(os.environ))


def test_a_scene_is_run(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    said = run(BALL)
    assert said.returncode == 0 and said.stderr == ""
    lines = said.stdout.splitlines()
    final = tangible.simulate(BALL).final
    assert lines[0] == "at 1.5 s" and lines[1].split()[:3] == ["body", "x", "(m)"]
    names = ("x", "y", "angle", "vx", "vy", "omega")
    assert lines[2].split() == ["ball", *(f"{final[f'ball/{name}']:.6g}" for name in names)]
    table, page = tmp_path / "run.csv", tmp_path / "run.html"
    assert main([BALL, f"--out={table}"]) == 0 and main([BALL, "--out", str(page)]) == 0
    assert capsys.readouterr().out == ""
    rows = table.read_text().splitlines()
    assert rows[0] == "time,body,x,y,angle,vx,vy,omega" and float(rows[-1].split(",")[2]) == final["ball/x"]
    assert page.read_text().startswith("<!DOCTYPE html>")


def test_a_fit_is_made(fit_file: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    page, out = tmp_path / "report.html", tmp_path / "found.json"
    assert main([fit_file, f"--report={page}", f"--out={out}"]) == 0
    lines = capsys.readouterr().out.splitlines()
    found = tangible.fit(fit_file)
    (name, ends), = found.intervals.items()
    assert ends is not None and ends[0] is not None and ends[1] is not None
    assert lines[0].split() == ["parameter", "estimate", "95", "%", "from", "to"]
    assert lines[1].split() == [*name.split(), *(f"{x:.6g}" for x in (found[name], *ends))]
    assert name in page.read_text() and page.read_text().startswith("<!DOCTYPE html>")
    assert json.loads(out.read_text())["parameters"] == found.data["parameters"]


def test_a_plan_is_made(plan_file: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    table = tmp_path / "plan.csv"
    assert main([plan_file, f"--out={table}"]) == 0
    found = tangible.plan(plan_file)
    expected = f"converged, cost {found.cost:.6g}, in the motion {found.motion.cost:.6g}\n"
    assert capsys.readouterr().out == expected
    found.save(tmp_path / "other.csv")
    assert table.read_text() == (tmp_path / "other.csv").read_text()


def test_bad_input_is_one_line_and_status_1(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    def written(name: str, text: str) -> str:
        (tmp_path / name).write_text(text)
        return str(tmp_path / name)

    scene = json.loads(Path(BALL).read_text())
    scene["bodies"][0]["mass"] = -1
    hang = {"bodies": [{"name": "a", "mass": 1, "inertia": 1, "position": [0, -1]}], "simulation": {"duration": 0.1}}
    still = {"scene": hang, "controls": [{"path": "forces/f/force/x", "low": 0, "high": 0}], "cost": []}
    for file, more, expected in [
        (str(tmp_path / "nothing.json"), [], "nothing.json: cannot be read: No such file or directory"),
        (written("text.json", "hello"), [], "text.json: line 1, column 1: malformed JSON"),
        (written("list.json", "[1]"), [], "list.json: "),
        (written("other.json", '{"a": 1}'), [], "other.json: expected a scene (bodies), a fit (observations or "
         "recordings) or a problem of control (controls, cost), got the keys a"),
        (written("scene.json", json.dumps(scene)), [], "scene.json: /bodies/0/mass: expected a number > 0, got -1"),
        (written("fit.json", '{"scene": "x.json", "observations": []}'), [], "x.json: cannot be read"),
        (written("plan.json", json.dumps(still)), [], "plan.json: "),
        (BALL, [f"--out={tmp_path}/none/run.csv"], "none/run.csv: cannot be written: no such folder"),
    ]:
        assert main([file, *more]) == 1
        said = capsys.readouterr()
        assert said.out == "" and len(said.err.splitlines()) == 1 and expected in said.err
    (tmp_path / "latin.json").write_bytes(b'{"name": "\xe9"}')
    assert main([str(tmp_path / "latin.json")]) == 1
    assert capsys.readouterr().err == f"{tmp_path}/latin.json: cannot be read: expected UTF-8\n"


def test_a_run_that_ends_early_is_written_and_status_1(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pole = {"bodies": [{"name": "bob", "mass": 1, "inertia": 0.01, "position": [0, -0.9]}],
            "joints": [{"name": "pin", "type": "revolute", "bodies": ["bob", "world"], "anchor": [0, 0], "rate": 900}],
            "simulation": {"dt": 0.01, "duration": 1, "stepping": "event"}}
    file, out = tmp_path / "scene.json", tmp_path / "run.csv"
    file.write_text(json.dumps(pole))
    assert main([str(file), f"--out={out}"]) == 1
    said = capsys.readouterr()
    assert "dt is too large" in said.err.splitlines()[-1] and out.read_text().startswith("time,body")


def test_wrong_usage_is_status_2(fit_file: str) -> None:
    for arguments, expected in [
        ([], "required: FILE"), ([BALL, "--bogus"], "unrecognized arguments: --bogus"),
        ([BALL, "--out=a.txt"], "--out: expected a name that ends in .csv or .html for a scene, got a.txt"),
        ([fit_file, "--out=a.csv"], "--out: expected a name that ends in .json for a fit, got a.csv"),
        ([BALL, "--report=a.html"], "--report: expected a fit, got a scene"),
        ([fit_file, "--report=a.json", "--out=a.json"], "expected files that differ"),
    ]:
        said = run(*arguments)
        assert said.returncode == 2 and said.stdout == "" and expected in said.stderr
    help_text = run("--help")
    assert help_text.returncode == 0 and "Exit status 0: done" in help_text.stdout and help_text.stderr == ""


@pytest.mark.parametrize("name", tangible.load_example())
def test_examples_run_and_can_be_trusted(name: str) -> None:
    scene = tangible.load_example(name)
    assert scene.name == name and f"Scene('{name}'" in repr(scene)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = tangible.simulate(scene, certify=True)
    assert found.certificate
    scene.add_body("late", mass=1, inertia=1, position=[9, 9])
    assert "late" not in tangible.load_example(name).bodies


def test_examples_are_what_they_are_called() -> None:
    assert tangible.load_example() == [
        "bouncing_ball", "cart_pole", "chain_hit_by_ball", "double_pendulum", "sliding_block"]
    assert "touch" in tangible.simulate(tangible.load_example("bouncing_ball")).events.kind
    hit = tangible.simulate(tangible.load_example("chain_hit_by_ball"))
    assert any("ball" in pair for pair in hit.events.bodies) and hit.joints.coordinates[-1].all()
    block = tangible.simulate(tangible.load_example("sliding_block")).final
    # It slides v^2 / (2 mu g) and stays there.
    assert block["block/x"] == pytest.approx(1.5**2 / (2 * 0.3 * 9.81), abs=1e-9)
    cart = tangible.Simulation(tangible.load_example("cart_pole"), ["joints/rail/effort"])
    cart.reset()
    assert cart.step([1.0])[3] > 0
    energies = tangible.simulate(tangible.load_example("double_pendulum")).energies.sum(axis=1)
    assert np.diff(energies).max() < 1e-5 and energies[-1] < energies[0]


def test_examples_travel_with_the_wheel() -> None:
    """Every file of the package is one that setuptools takes along, and that the build tree links."""
    text = (PACKAGE / "pyproject.toml").read_text(encoding="utf-8")
    assert '"scenes/*.json"' in text and 'packages = ["tangible"]' in text
    cmake = (PACKAGE / "CMakeLists.txt").read_text(encoding="utf-8")
    linked = cmake.split("foreach(source IN ITEMS ")[1].split(")")[0].split()
    present = {path.name for path in (PACKAGE / "tangible").iterdir() if path.name != "__pycache__"}
    assert set(linked) == present
    assert {path.suffix for path in (PACKAGE / "tangible" / "scenes").iterdir()} == {".json"}


def test_the_version_is_told(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["--version"])
    assert ended.value.code == 0
    assert capsys.readouterr().out == f"tangible {tangible.__version__}\n"
