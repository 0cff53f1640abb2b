"""What Python costs: a call over the C++ rollout, batches on two cores, torch's forward and backward pass.

Best CPU or wall times of repeated runs; ratios are of runs in one process, one after the other.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import tangible
import torch
from tangible.torch import rollout as torch_rollout

ROOT = Path(__file__).resolve().parents[2]
CHAIN = ROOT / "data" / "scenes" / "chain.json"


def best(work: Callable[[], object], repeats: int) -> float:
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return min(times)


def cpp_seconds(scene: Path, parameter: str, repeats: int) -> float:
    """CPU time of a plain rollout in C++, the best of several."""
    program = Path(sys.argv[1] if len(sys.argv) > 1 else ROOT / "build/release/bin") / "tangible-gradient"
    text = subprocess.run(
        [program, scene, f"--parameters={parameter}", f"--repeat={repeats}"],
        check=True, capture_output=True, text=True,
    ).stdout
    return float(json.loads(text)["rollout_seconds"])


def main() -> None:
    torch.set_num_threads(1)
    short = tangible.Scene(CHAIN, simulation={"dt": 0.002, "duration": 0.02})
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "short.json"
        short.save(file)
        mass = "bodies/link*/mass"
        cpp = min(cpp_seconds(file, mass, 200) for _ in range(5))
    ten = tangible.Rollout(short, [mass])
    call = best(ten, 2000)
    print(f"call of 10 steps of the chain: {1e6 * call:.1f} us, C++ {1e6 * cpp:.1f} us, over {1e6 * (call - cpp):.1f} us")

    one = tangible.Rollout(CHAIN, [mass], threads=1)
    two = tangible.Rollout(CHAIN, [mass], threads=2)
    masses = np.linspace(0.3, 1.299, 1000)[:, None]
    seconds = {1: [], 2: []}  # type: dict[int, list[float]]
    for _ in range(10):
        for threads, function in ((1, one), (2, two)):
            seconds[threads].append(best(lambda f=function: f(masses), 1))  # type: ignore[misc]
    ratio = min(seconds[1]) / min(seconds[2])
    print(f"1000 rollouts of the chain: {min(seconds[1]):.2f} s on one thread, {min(seconds[2]):.2f} s on two: {ratio:.2f} times")

    full = cpp_seconds(CHAIN, mass, 50)
    p = torch.tensor(one.default_parameters, requires_grad=True)

    def both() -> None:
        p.grad = None
        torch_rollout(one, p).sum().backward()

    layer = best(both, 50)
    print(f"torch forward and backward, 750 steps: {1e3 * layer:.2f} ms, C++ rollout {1e3 * full:.2f} ms: {layer / full:.2f} times")


if __name__ == "__main__":
    main()
