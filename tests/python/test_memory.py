"""Ten thousand calls keep no memory."""

from __future__ import annotations

import ctypes
import gc
from pathlib import Path

import numpy as np
import pytest
import tangible

from conftest import ball


def resident() -> float:
    """Memory of the process, MB."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * 4096 / 1e6


def test_ten_thousand_calls_keep_no_memory(capsys: pytest.CaptureFixture[str]) -> None:
    rollout = tangible.Rollout(ball(duration=0.05), ["bodies/ball/mass"], ["forces/push/force/x"], threads=1)
    ones = np.ones(6)

    def calls(count: int) -> None:
        for _ in range(count):
            rollout()
            _, pull = rollout.vjp([1.1])
            pull(ones)
            rollout.jvp((None, None, None), (None, ones, None))
            tangible.simulate(rollout.scene, every=5)
        gc.collect()

    calls(500)
    before = resident()
    calls(2000)
    middle = resident()
    calls(500)
    after = resident()
    with capsys.disabled():
        print(f"\n10 000 calls: {before:.1f} MB before, {after:.1f} MB after")
    assert after - before < 3.0 and after - middle < 1.0


def test_memory_of_large_calls_is_returned() -> None:
    rollout = tangible.Rollout(ball(), ["bodies/ball/mass"], ["forces/push/force/x"])
    masses = np.ones((4000, 1))
    rollout(masses[:2])
    gc.collect()
    ctypes.CDLL(None).malloc_trim(0)  # what other tests have left
    before = resident()
    states, pull = rollout.vjp(masses)
    pull(np.ones_like(states))
    during = resident()
    del states, pull
    gc.collect()
    assert during - before > 50.0  # else nothing is shown
    assert resident() - before < 0.2 * (during - before)
