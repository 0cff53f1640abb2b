"""The mass of a chain that a ball hits, from noisy positions of its links."""

import sys
from pathlib import Path

import tangible

fits = Path(__file__).resolve().parents[3] / "data" / "fits"
result = tangible.fit(fits / "chain.json")
low, high = result.interval("chain mass") or (0.0, 0.0)
print(f"chain mass {result['chain mass']:.6f} kg, 95 %: {low:.5f} to {high:.5f}")
print(f"{len(result.data['iterations']) - 1} iterations, {result.data['rollouts']} rollouts")
assert low < 7.0 < high and high - low < 0.01

if len(sys.argv) > 1:
    result.plot().figure.savefig(sys.argv[1], dpi=70)
