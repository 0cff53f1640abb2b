"""A wrong argument is said in one line: which, what was expected, what was found."""

from __future__ import annotations

import contextlib
import inspect
import io
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tangible

from conftest import ball

PUSH = "forces/push/force/x"
MASS = "bodies/ball/mass"
DATA = {"time": np.array([0.0, 0.1, 0.2]), "x": np.array([0.0, 0.05, 0.1])}
VELOCITY = ["bodies/ball/velocity/x"]


def fit(**keys: Any) -> Any:
    return tangible.fit(ball(), **{"data": DATA, "parameters": VELOCITY, "sigma": 0.01, **keys})


def problem() -> dict[str, Any]:
    return {
        "scene": ball(duration=0.1), "controls": [{"path": PUSH, "low": -1, "high": 1}],
        "cost": [{"control": PUSH}, {"state": "ball/x", "target": 0.1, "at": "end"}],
        "mpc": {"horizon": 0.02, "iterations": 1, "duration": 0.02}}


def simulation(**keys: Any) -> tangible.Simulation:
    made = tangible.Simulation(ball(), [PUSH], **keys)
    made.reset()
    return made


WRONG: list[tuple[Callable[[], Any], type[Exception], str]] = [
    (lambda: fit(max_iterations=2.5), TypeError, "max_iterations: expected a whole number >= 1, got 2.5"),
    (lambda: fit(max_iterations="3"), TypeError, "max_iterations: expected a whole number >= 1, got '3'"),
    (lambda: fit(max_iterations=0), ValueError, "max_iterations: expected a whole number >= 1, got 0"),
    (lambda: fit(predict_from="3"), TypeError, "predict_from: expected a time in s, got '3'"),
    (lambda: fit(predict_from=np.nan), ValueError, "predict_from: expected a time in s, got NaN"),
    (lambda: fit(callback=3), TypeError, "callback: expected a function or None, got 3"),
    (lambda: fit(progress="yes"), TypeError, "progress: expected True or False, got 'yes'"),
    (lambda: fit(checkpoint=3), TypeError, "checkpoint: expected a file's name, got int"),
    (lambda: fit(points=[1]), TypeError,
     'points: expected a dict {name: {"body": name, "at": [x, y]}}, got list'),
    (lambda: fit(initial=[1]), TypeError, "initial: expected a dict {name: value}, got list"),
    (lambda: fit(initial={VELOCITY[0]: "a"}), TypeError,
     f"initial {VELOCITY[0]}: expected a finite number, got 'a'"),
    (lambda: fit(initial={"x": 1}), tangible.TangibleError,
     f"initial: no parameter of the fit is named x; its parameters are: {VELOCITY[0]}"),
    (lambda: fit(parameters=3), TypeError, "parameters: expected a list of paths, got 3"),
    (lambda: fit(data=None, recordings=DATA), TypeError,
     "recordings: expected a list of tables or a dict {name: table}, got one table: [table]"),
    (lambda: fit(data=None, recordings=3), TypeError,
     "recordings: expected a list of tables or a dict {name: table}, got int"),
    (lambda: tangible.fit(3), TypeError,  # type: ignore[arg-type]
     "problem: expected a fit file or a dict of its JSON, got int"),
    (lambda: simulation(batch=2.5), TypeError, "batch: expected a whole number >= 1, got 2.5"),
    (lambda: simulation(batch=0), ValueError, "batch: expected a whole number >= 1, got 0"),
    (lambda: simulation(threads=-1), ValueError, "threads: expected a whole number from 0 to 256, got -1"),
    (lambda: simulation(noise={"ball/x": -1}), ValueError,
     "noise ball/x: expected a standard deviation >= 0, got -1"),
    (lambda: simulation(noise={MASS: np.nan}), ValueError,
     f"noise {MASS}: expected a standard deviation >= 0, got NaN"),
    (lambda: simulation(noise=[1]), TypeError, "noise: expected a dict {name: standard deviation}, got list"),
    (lambda: simulation(domains={MASS: [np.nan]}), ValueError,
     f"domains {MASS}: expected finite numbers, got [nan]"),
    (lambda: simulation().step(steps=1.5), TypeError,  # type: ignore[arg-type]
     "steps: expected a whole number >= 1, got 1.5"),
    (lambda: simulation().reset(seed=-1), ValueError, "seed: expected a whole number >= 0, got -1"),
    (lambda: simulation().reset(seed="a"), TypeError,  # type: ignore[arg-type]
     "seed: expected a whole number >= 0, got 'a'"),
    (lambda: simulation(parameters=[MASS]).reset(parameters=[np.nan]), tangible.TangibleError,
     f"{MASS}: expected a finite number, got NaN"),
    (lambda: tangible.simulate(ball(), every=1.5), TypeError,  # type: ignore[arg-type]
     "every: expected a whole number >= 1, got 1.5"),
    (lambda: tangible.simulate(ball(), certify=3), TypeError,  # type: ignore[arg-type]
     "certify: expected True or False, got 3"),
    (lambda: tangible.simulate(ball(), controls=np.ones(60)), TypeError,  # type: ignore[arg-type]
     "controls: expected a dict {path: a number, or one for each step}, got ndarray"),
    (lambda: tangible.simulate(ball(), [1]), TypeError,  # type: ignore[arg-type]
     "parameters: expected a dict {path: value}, got list"),
    (lambda: tangible.simulate(None), TypeError,  # type: ignore[arg-type]
     "scene: expected a Scene, a scene file or a dict of its JSON, got NoneType"),
    (lambda: tangible.simulate(ball(), {MASS: np.nan}), tangible.TangibleError,
     f"ball: {MASS}: expected a finite number, got NaN"),
    (lambda: tangible.simulate(ball(), controls={PUSH: [0.0] * 59 + [np.inf]}), tangible.TangibleError,
     f"controls {PUSH}: expected a finite number, got Infinity in step 59"),
    (lambda: tangible.Rollout(ball(), None), TypeError,  # type: ignore[arg-type]
     "parameters: expected a list of paths, got None"),
    (lambda: tangible.Rollout(ball(), records=3), TypeError,  # type: ignore[arg-type]
     "records: expected a list of whole numbers, got 3"),
    (lambda: tangible.Rollout(ball(), threads=2.5), TypeError,  # type: ignore[arg-type]
     "threads: expected a whole number from 0 to 256, got 2.5"),
    (lambda: tangible.Scene(3), TypeError,  # type: ignore[arg-type]
     "scene: expected a Scene, a scene file or a dict of its JSON, got int"),
    (lambda: tangible.Scene([1]), TypeError,  # type: ignore[arg-type]
     "scene: expected a Scene, a scene file or a dict of its JSON, got list"),
    (lambda: tangible.Scene(ball())[3], TypeError,  # type: ignore[index]
     "path: expected the path of a parameter, got 3"),
    (lambda: tangible.plan(3), TypeError,  # type: ignore[arg-type]
     "problem: expected a file of a problem or a dict of its JSON, got int"),
    (lambda: tangible.plan(problem(), threads=2.5), TypeError,  # type: ignore[arg-type]
     "threads: expected a whole number from 0 to 256, got 2.5"),
    (lambda: tangible.plan(problem(), initial=[1]), TypeError,  # type: ignore[arg-type]
     "initial: expected a plan, a file that it saved, or a dict {path: a number for each step}, got list"),
    (lambda: tangible.mpc(problem(), plant=[1]), TypeError,  # type: ignore[arg-type]
     "plant: expected a Scene, a scene file or a dict of its JSON, got list"),
    (lambda: tangible.mpc(problem(), budget="a"), TypeError,  # type: ignore[arg-type]
     "budget: expected a time > 0 in s, got 'a'"),
    (lambda: tangible.Smoothing(samples=2.5), TypeError,  # type: ignore[arg-type]
     "samples: expected an even number >= 2, got 2.5"),
    (lambda: tangible.load_example("ball"), ValueError,
     "name: expected one of bouncing_ball, cart_pole, chain_hit_by_ball, double_pendulum, sliding_block, got 'ball'"),
]


@pytest.mark.parametrize("wrong", WRONG, ids=[said for _, _, said in WRONG])
def test_one_line_says_what_is_wrong(wrong: tuple[Callable[[], Any], type[Exception], str]) -> None:
    call, kind, said = wrong
    with pytest.raises(kind) as caught:
        call()
    assert type(caught.value) is kind and str(caught.value) == said


def test_numbers_of_numpy_are_welcome(tmp_path: Path) -> None:
    made = tangible.Simulation(ball(), batch=np.int64(2), threads=np.int32(1),  # type: ignore[arg-type]
                               noise={"ball/vx": np.float32(0.1)})  # type: ignore[dict-item]
    assert made.reset(seed=np.uint64(3)).shape == (2, 6)  # type: ignore[arg-type]
    assert made.step(steps=np.int8(2)).shape == (2, 6)  # type: ignore[arg-type]
    run = tangible.simulate(ball(), every=np.int64(10), certify=np.bool_(True))  # type: ignore[arg-type]
    assert len(run.times) == 7 and run.certificate is not None
    assert fit(max_iterations=np.int64(9), predict_from=np.float64(0.1)).status == "converged"


def test_nan_is_said_of_its_row() -> None:
    rollout = tangible.Rollout(ball(), [MASS], [PUSH])
    for call in (rollout, rollout.vjp):
        with pytest.raises(tangible.TangibleError, match=f"^{MASS}: expected a finite number, got NaN$"):
            call([np.nan])
        with pytest.raises(tangible.TangibleError, match=f"^row 1: {MASS}: expected a finite number, got -Infinity$"):
            call([[1.0], [-np.inf]])
        with pytest.raises(tangible.TangibleError, match="^initial_state ball/y: expected a finite number, got NaN$"):
            call(None, {"ball/y": np.nan})
    states = rollout([[1.0], [np.nan]], on_failure="nan")
    assert np.isfinite(states[0]).all() and np.isnan(states[1]).all()


JUNK: list[Any] = [
    3, 2.5, -1, "x", [1], None, object(), np.array([1.0, 2.0]), np.nan, True, b"x", {"x": 1}, {3: 4}, 1j,
    np.ma.masked_array([0.1], [True]), (), print]
# Names of files are not tried with texts, which are such; axes are matplotlib's affair.
FILES = ("file", "checkpoint", "folder")


def calls(folder: Path) -> list[tuple[Callable[..., Any], dict[str, Any]]]:
    scene = tangible.Scene(ball())
    rollout = tangible.Rollout(ball(), [MASS], [PUSH])
    of_fit = {"problem": ball(), "data": DATA, "parameters": VELOCITY, "sigma": 0.01}
    found = fit()
    residuals = tangible.Residuals(**of_fit)
    plan = tangible.plan(problem(), on_failure="return")
    run = tangible.simulate(ball())
    many = tangible.Simulation(ball(), [PUSH], batch=2)
    many.reset()
    none = (None, None, None)
    return [
        (tangible.Scene, {"scene": scene}), (scene.with_parameters, {"parameters": {}}),
        (scene.save, {"file": folder / "a"}), (scene.range, {"path": MASS}), (scene.__getitem__, {"path": MASS}),
        (tangible.simulate, {"scene": scene}), (tangible.Rollout, {"scene": scene}), (rollout, {}),
        (rollout.vjp, {}), (rollout.jvp, {"primals": none, "tangents": none}), (rollout.jacobian, {}),
        (rollout.certificate, {}), (rollout.certificates, {}), (tangible.Simulation, {"scene": scene}),
        (many.reset, {}), (many.step, {}), (tangible.Smoothing, {}), (tangible.fit, of_fit),
        (tangible.Residuals, of_fit), (residuals, {"parameters": [0.1]}), (found.domains, {"count": 3}),
        (found.interval, {"name": VELOCITY[0]}), (found.__getitem__, {"name": VELOCITY[0]}), (found.report, {}),
        (tangible.plan, {"problem": problem(), "on_failure": "return"}), (tangible.mpc, {"problem": problem()}),
        (plan.save, {"file": folder / "a"}), (plan.__getitem__, {"name": PUSH}), (plan.simulate, {}),
        (run.to_csv, {"file": folder / "a"}), (run.__getitem__, {"name": "ball/x"}), (run.unit, {"name": "ball/x"}),
        (tangible.load_example, {})]


def test_whatever_is_given_one_line_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Seventeen values for each argument of each public function, one at a time."""
    monkeypatch.chdir(tmp_path)
    failures, count = [], 0
    for function, good in calls(tmp_path):
        for name, parameter in inspect.signature(function).parameters.items():
            if parameter.kind in (parameter.VAR_KEYWORD, parameter.VAR_POSITIONAL):
                continue
            for value in JUNK:
                if name in FILES and isinstance(value, (str, bytes)):
                    continue
                short = {"posterior": 1, "posterior_chains": 1, "posterior_warm_up": 0}
                more = short if name.startswith("posterior") else {}
                with warnings.catch_warnings(), contextlib.redirect_stderr(io.StringIO()), \
                        contextlib.redirect_stdout(io.StringIO()):
                    warnings.simplefilter("ignore")
                    try:
                        function(**{**good, **more, name: value})
                    except (TypeError, ValueError, KeyError) as error:
                        said = str(error.args[0])
                        count += 1
                        if "\n" in said or not ("expected" in said or "cannot be read" in said or "no parameter" in said
                                                or "unsolved" in said or "may not take" in said):
                            failures.append((function, name, value, said))
                    except Exception as error:
                        failures.append((function, name, value, repr(error)))
    assert not failures and count > 1000
