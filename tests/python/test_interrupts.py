"""Ctrl-C ends each computation soon, in the main thread, and what was interrupted can be used again."""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tangible

from conftest import ball

FITS = Path(__file__).resolve().parents[2] / "data" / "fits"
# s of CPU time of all threads that it may take, which other work on the machine does not change; signals are
# looked for every 50 ms.
LATEST = 0.5
ROWS = 20000  # of a batch: more than can be done before the signal


def crowd(stepping: str, duration: float) -> dict[str, Any]:
    """Boxes that fall on one another: steps that take long."""
    boxes = [
        {"name": f"box_{k}", "shape": {"box": {"size": [0.2, 0.2]}}, "mass": 1 + 0.1 * k,
         "position": [0.01 * (k % 3), 0.12 + 0.25 * k], "friction": 0.4}
        for k in range(12)
    ]
    floor = {"name": "floor", "static": True, "friction": 0.4,
             "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}
    return {"name": "crowd", "bodies": [*boxes, floor],
            "simulation": {"stepping": stepping, "dt": 1e-3, "duration": duration}}


def interrupted(work: Callable[[], Any], after: float = 0.2) -> None:
    """Asserts that a signal so many seconds after the start ends `work`."""
    sent: list[float] = []

    def send() -> None:
        sent.append(time.process_time())
        os.kill(os.getpid(), signal.SIGINT)

    timer = threading.Timer(after, send)
    timer.start()
    try:
        with pytest.raises(KeyboardInterrupt):
            work()
            # What ends before the signal shows nothing.
            timer.cancel()
            pytest.fail(f"the work ended before the signal, or ignored it: {sent}")
        took = time.process_time() - sent[0]
        assert took < LATEST, f"{took:.2f} s after the signal"
    finally:
        timer.cancel()
        timer.join()


@pytest.fixture(scope="module")
def long() -> tangible.Rollout:
    """One run that takes minutes."""
    return tangible.Rollout(crowd("event", 1000.0), ["bodies/*/mass"])


@pytest.fixture(scope="module")
def many() -> tuple[tangible.Rollout, Any]:
    """A batch that takes minutes."""
    rollout = tangible.Rollout(crowd("event", 0.5), ["bodies/*/mass"])
    return rollout, np.tile(rollout.default_parameters, (ROWS, 1))


@pytest.fixture(scope="module")
def long_pull() -> Callable[[], Any]:
    """A reverse sweep that takes longer than an interruption may: some 0.15 s a row."""
    rollout = tangible.Rollout(crowd("event", 1.0), ["bodies/*/mass"])
    states, pull = rollout.vjp(np.tile(rollout.default_parameters, (10, 1)))
    return lambda: pull(np.ones_like(states))


@pytest.mark.parametrize("stepping", ["fixed", "event"])
@pytest.mark.parametrize("certify", [False, True])
def test_simulate(stepping: str, certify: bool) -> None:
    scene = tangible.Scene(crowd(stepping, 1000.0))
    interrupted(lambda: tangible.simulate(scene, certify=certify))
    short = tangible.Scene(scene.to_dict(), simulation={"duration": 0.01})
    assert tangible.simulate(short).status == "done"


@pytest.mark.parametrize("method", ["adjoint", "tangent", "jet", "jet_implicit", "finite_difference"])
def test_jacobian(long: tangible.Rollout, method: str) -> None:
    interrupted(lambda: long.jacobian(method=method))


def test_one_run_and_its_certificate(long: tangible.Rollout) -> None:
    interrupted(long)
    interrupted(long.certificate)
    interrupted(lambda: long.jvp((None, None, None), (np.ones(1), None, None)))
    interrupted(lambda: long.vjp(kinks="raise"))


@pytest.mark.parametrize("threads", [1, 2])
def test_batches(many: tuple[tangible.Rollout, Any], threads: int) -> None:
    rollout, p = many
    rollout.threads = threads
    interrupted(lambda: rollout(p))
    interrupted(lambda: rollout.jvp((p, None, None), (np.ones_like(p), None, None)))
    interrupted(lambda: rollout.vjp(p))
    interrupted(lambda: rollout.certificates(p))


# The main thread has few rows and waits for those of the others.
def test_a_thread_that_waits_for_the_others(long: tangible.Rollout) -> None:
    long.threads = 3
    interrupted(lambda: long(np.tile(long.default_parameters, (3, 1))))


@pytest.mark.parametrize("stepping", ["fixed", "event"])
@pytest.mark.parametrize("threads", [1, 2])
def test_pull_which_is_right_afterwards(stepping: str, threads: int) -> None:
    rollout = tangible.Rollout(crowd(stepping, 0.3), ["bodies/*/mass"], threads=threads)
    states, pull = rollout.vjp(np.tile(rollout.default_parameters, (8, 1)))
    bars = np.random.default_rng(0).normal(size=states.shape)
    expected = pull(bars)

    def again() -> None:
        while True:
            pull(bars)

    interrupted(again)
    assert all(np.array_equal(a, b) for a, b in zip(pull(bars), expected))


def test_a_single_long_pull(long_pull: Callable[[], Any]) -> None:
    interrupted(lambda: [long_pull() for _ in range(1000)], 0.1)


def test_a_thread_that_waits_for_its_turn(long_pull: Callable[[], Any]) -> None:
    ends = threading.Event()

    def busy() -> None:
        while not ends.is_set():
            long_pull()

    other = threading.Thread(target=busy)
    other.start()

    def wait() -> None:
        while True:
            long_pull()

    try:
        interrupted(wait)
    finally:
        ends.set()
        other.join()


def test_fits_and_residuals() -> None:
    interrupted(lambda: [tangible.fit(FITS / "chain_fine.json") for _ in range(100)], 0.2)
    residuals = tangible.Residuals(FITS / "chain.json")
    expected = residuals.jacobian(residuals.initial)
    interrupted(lambda: [residuals.jacobian(residuals.initial) for _ in range(100000)])
    interrupted(lambda: [residuals(residuals.initial) for _ in range(100000)])
    assert np.array_equal(residuals.jacobian(residuals.initial), expected)


def test_torch() -> None:
    torch = pytest.importorskip("torch")
    from tangible.torch import rollout

    function = tangible.Rollout(crowd("event", 0.3), ["bodies/*/mass"])
    p = torch.ones(8, 1, dtype=torch.float64, requires_grad=True)

    def train() -> None:
        while True:
            rollout(function, p).sum().backward()

    interrupted(train)
    p.grad = None
    rollout(function, p).sum().backward()
    assert np.array_equal(
        p.grad.numpy(), function.vjp(p.detach().numpy())[1](np.ones((8, 72)))[0])


# A handler that calls what it has interrupted would wait for itself.
def test_a_handler_that_calls_what_it_has_interrupted() -> None:
    rollout = tangible.Rollout(ball(duration=0.6), ["bodies/ball/mass"])
    states, pull = rollout.vjp(np.tile(rollout.default_parameters, (2000, 1)))
    messages: list[str] = []

    def handle(*_: Any) -> None:
        try:
            pull(np.ones_like(states))
            messages.append("done")
        except tangible.TangibleError as error:
            messages.append(str(error))

    before = signal.signal(signal.SIGALRM, handle)
    try:
        while not messages or messages[-1] == "done":
            signal.setitimer(signal.ITIMER_REAL, 0.02)
            pull(np.ones_like(states))
    finally:
        signal.signal(signal.SIGALRM, before)
    assert "signal's handler" in messages[-1]
