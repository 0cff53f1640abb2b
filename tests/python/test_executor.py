"""Executors of concurrent.futures do the rows of batches, with the same bits."""

from __future__ import annotations

import multiprocessing
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tangible

from conftest import ball

PARAMETERS = ["bodies/ball/velocity/x", "bodies/ball/restitution"]


def values(rows: int) -> Any:
    return np.random.default_rng(4).uniform([0.2, 0.3], [1.0, 0.9], (rows, 2))


@pytest.fixture(scope="module", params=["fork", "spawn", "threads"])
def executor(request: pytest.FixtureRequest) -> Iterator[Executor]:
    if request.param == "threads":
        with ThreadPoolExecutor(2) as pool:
            yield pool
        return
    context = multiprocessing.get_context(request.param)
    with ProcessPoolExecutor(2, mp_context=context) as pool:
        yield pool


def pid() -> int:
    return os.getpid()


@pytest.mark.parametrize("rows", [1, 3, 50])
def test_batches_have_the_same_bits(executor: Executor, rows: int) -> None:
    rollout = tangible.Rollout(ball(), PARAMETERS, ["forces/push/force/x"], records=[10, 60])
    p = values(rows)
    u = np.random.default_rng(1).normal(size=(rows, 60, 1))
    x = np.tile(rollout.default_initial_state, (rows, 1))
    for arguments in ((p,), (p, None, u), (p, x, u)):
        assert np.array_equal(rollout(*arguments, executor=executor), rollout(*arguments))
    alone = rollout.jvp((p, None, u), (p, None, None))
    shared = rollout.jvp((p, None, u), (p, None, None), executor=executor)
    assert all(np.array_equal(a, b) for a, b in zip(alone, shared))
    assert rollout.certificates(p, executor=executor) == rollout.certificates(p)
    one = rollout(p[0], executor=executor)
    assert one.shape == (2, 6) and np.array_equal(one, rollout(p[0]))


def test_rows_that_fail_are_named_by_their_number_in_the_batch(executor: Executor) -> None:
    rollout = tangible.Rollout(ball(), PARAMETERS)
    p = values(40)
    p[33, 1] = 2.0
    p[37, 1] = 3.0
    with pytest.raises(tangible.TangibleError, match="^row 33: .*restitution"):
        rollout(p, executor=executor)
    there = rollout(p, on_failure="nan", executor=executor)
    assert np.array_equal(there, rollout(p, on_failure="nan"), equal_nan=True)
    assert np.isnan(there[[33, 37]]).all() and np.isfinite(there[:33]).all()


def test_processes_do_the_work() -> None:
    """What is submitted is picklable, and runs elsewhere."""
    sent: list[tuple[Any, ...]] = []

    class Watched(ProcessPoolExecutor):
        def submit(self, *arguments: Any, **names: Any) -> Future[Any]:  # type: ignore[override]
            sent.append(arguments)
            return super().submit(*arguments, **names)

    with Watched(2) as pool:
        assert pool.submit(pid).result() != os.getpid()
        sent.clear()
        tangible.Rollout(ball(), PARAMETERS)(values(100), executor=pool)
    assert len(sent) == 8
    assert [len(arguments[3][0]) for arguments in sent] == [12, 13] * 4


BALL_PARAMETERS = [
    {"name": "speed", "initial": 0.6, "lower": 0.1, "upper": 2.0,
     "sets": [{"path": "bodies/ball/velocity/x"}]},
    {"name": "restitution", "initial": 0.6, "lower": 0.1, "upper": 1.0,
     "sets": [{"path": "bodies/*/restitution"}]},
]


def table() -> dict[str, Any]:
    rollout = tangible.Rollout(ball(), records=range(61))
    states = rollout()
    noise = 1e-3 * np.random.default_rng(2).normal(size=(61, 2))
    return {"time": rollout.times, "ball/x": states[:, 0] + noise[:, 0], "ball/y": states[:, 1] + noise[:, 1]}


def without_times(data: Any) -> Any:
    if isinstance(data, dict):
        return {key: without_times(item) for key, item in data.items() if key != "seconds"}
    return [without_times(item) for item in data] if isinstance(data, list) else data


def fitted(**more: Any) -> tuple[tangible.FitResult, list[Any]]:
    said: list[Any] = []
    result = tangible.fit(
        ball(), table(), BALL_PARAMETERS, sigma=1e-3,
        callback=lambda now: said.append(without_times(now)), **more,
    )
    return result, said


@pytest.mark.parametrize(
    "how",
    [
        {"starts": 4, "seed": 3},
        {"profile": ["restitution", "speed"]},
        {"starts": 3, "profile": ["speed"], "predict_from": 0.5},
        {"profile": ["speed"], "loss": {"huber": 2}},
        {"starts": 2, "posterior": 40, "posterior_chains": 3, "posterior_warm_up": 30, "posterior_seed": 5},
    ],
)
def test_fits_have_the_same_bits(executor: Executor, how: dict[str, Any]) -> None:
    alone, told = fitted(**how)
    shared, told_by_others = fitted(**how, executor=executor)
    assert shared.status == "converged"
    assert without_times(shared.data) == without_times(alone.data)
    assert told_by_others == told and len(told) > how.get("starts", 1)
    assert len(shared.data["starts"]) >= how.get("starts", 1)
    assert len(shared.data.get("profiles") or []) >= len(how.get("profile", []))
    assert list(shared.draws) == list(alone.draws) and bool(shared.draws) == ("posterior" in how)
    assert all(np.array_equal(shared.draws[name], alone.draws[name]) for name in alone.draws)
    assert shared.scene.to_json() == alone.scene.to_json()


def test_fits_send_starts_and_profiles() -> None:
    sent: list[tuple[Any, ...]] = []

    class Watched(ThreadPoolExecutor):
        def submit(self, *arguments: Any, **names: Any) -> Future[Any]:  # type: ignore[override]
            sent.append(arguments)
            return super().submit(*arguments, **names)

    with Watched(2) as pool:
        fitted(starts=3, profile=["speed", "restitution"], executor=pool)
        assert [arguments[2] for arguments in sent] == [0, 1, 2, "speed", "restitution"]
        sent.clear()
        fitted(executor=pool)
        assert not sent
        fitted(posterior=9, posterior_chains=3, posterior_warm_up=5, executor=pool)
        assert [(arguments[0].__name__, arguments[2]) for arguments in sent] == [
            ("_start", 0), ("_chain", 0), ("_chain", 1), ("_chain", 2)
        ]
        with pytest.raises(tangible.TangibleError, match="profile: expected names"):
            fitted(profile=["mass"], executor=pool)
        with pytest.raises(ValueError, match="checkpoint: not with executor"):
            fitted(checkpoint="c.json", executor=pool)
    with pytest.raises(TypeError, match="executor: expected"):
        fitted(executor=2)


class Broken(Executor):
    """Fails at the third part; the others are never begun."""

    def __init__(self) -> None:
        self.futures: list[Future[Any]] = []

    def submit(self, *arguments: Any, **names: Any) -> Future[Any]:  # type: ignore[override]
        future: Future[Any] = Future()
        self.futures.append(future)
        if len(self.futures) == 1:
            future.set_exception(OSError("a node was lost"))
        return future


def test_an_executor_that_fails_ends_the_call() -> None:
    broken = Broken()
    with pytest.raises(OSError, match="a node was lost"):
        tangible.Rollout(ball(), PARAMETERS)(values(50), executor=broken)
    assert len(broken.futures) > 1 and all(future.cancelled() for future in broken.futures[1:])


def test_what_is_no_executor_is_refused() -> None:
    rollout = tangible.Rollout(ball(), PARAMETERS)
    for call in (rollout, rollout.certificates):
        with pytest.raises(TypeError, match="executor: expected one of concurrent.futures"):
            call(values(2), executor=4)  # type: ignore[operator]
    with pytest.raises(TypeError, match="executor: expected"):
        rollout.jvp((values(2), None, None), (None, None, None), executor="processes")  # type: ignore[arg-type]


MPI = """
import numpy, tangible
from mpi4py.futures import MPIPoolExecutor
from test_executor import PARAMETERS, ball, fitted, values, without_times

if __name__ == "__main__":
    rollout = tangible.Rollout(ball(), PARAMETERS)
    with MPIPoolExecutor() as executor:
        found = rollout(values(50), executor=executor)
        fit, said = fitted(starts=3, profile=["speed"], executor=executor)
    assert without_times(fit.data) == without_times(fitted(starts=3, profile=["speed"])[0].data)
    assert numpy.array_equal(found, rollout(values(50)))
    print("the same bits")
"""


def test_mpi4py_executors_have_the_same_bits(tmp_path: Path) -> None:
    pytest.importorskip("mpi4py", reason="python3-mpi4py is not installed")
    mpirun = shutil.which("mpirun")
    if mpirun is None:
        pytest.skip("mpirun is not installed")
    (tmp_path / "run.py").write_text(MPI)
    paths = [str(Path(__file__).parent), os.environ.get("PYTHONPATH", "")]
    run = subprocess.run(
        [mpirun, "--allow-run-as-root", "--oversubscribe", "-n", "3", sys.executable, "-m",
         "mpi4py.futures", "run.py"],
        cwd=tmp_path, env={**os.environ, "PYTHONPATH": os.pathsep.join(paths)},
        capture_output=True, text=True, timeout=120,
    )
    assert run.returncode == 0 and run.stdout == "the same bits\n", run.stderr
