"""A network that infers the masses of two colliding discs from their motion, trained through the engine."""

import sys

import tangible
import torch
from tangible.torch import rollout

torch.manual_seed(0)
torch.set_num_threads(1)
scene = tangible.Scene(gravity=[0, 0], simulation={"stepping": "event", "dt": 0.1, "duration": 1.0})
for name, x, speed in (("left", 0.0, 1.0), ("right", 1.0, 0.0)):
    scene.add_body(
        name, shape={"circle": {"radius": 0.1}}, mass=1.0, position=[x, 0.02 * x],
        velocity=[speed, 0], restitution=0.9,
    )
function = tangible.Rollout(scene, ["bodies/left/mass", "bodies/right/mass"], records=[10])


def motion(ratio: torch.Tensor) -> torch.Tensor:
    return rollout(function, torch.stack([torch.ones_like(ratio), ratio], dim=1))


def features(states: torch.Tensor) -> torch.Tensor:
    return states[:, 0, [0, 1, 6, 7]]


network = torch.nn.Sequential(
    torch.nn.Linear(4, 32), torch.nn.Tanh(), torch.nn.Linear(32, 1)
).double()
optimiser = torch.optim.Adam(network.parameters(), lr=1e-2)
for step in range(250):
    ratio = torch.exp(2.0 * torch.rand(32, dtype=torch.float64) - 1.0)
    with torch.no_grad():
        seen = motion(ratio)
    # No label: the motion with the inferred mass is to be the motion that was seen.
    inferred = torch.exp(network(features(seen))[:, 0])
    loss = ((motion(inferred) - seen) ** 2).mean()
    optimiser.zero_grad()
    loss.backward()
    optimiser.step()
with torch.no_grad():
    ratio = torch.linspace(0.45, 2.2, 50, dtype=torch.float64)
    found = torch.exp(network(features(motion(ratio)))[:, 0])
    error = (found / ratio - 1.0).abs()
print(f"mass ratio inferred to {100 * error.median():.2f} % in the median, {100 * error.max():.2f} % at most")
assert error.median() < 0.02 and error.max() < 0.1

if len(sys.argv) > 1:  # the picture: inferred against true ratios
    import matplotlib.pyplot as plt

    axes = plt.subplots()[1]
    axes.plot(ratio, ratio, color="0.7")
    axes.plot(ratio, found, ".")
    axes.set_xlabel("true mass ratio")
    axes.set_ylabel("inferred from motion")
    axes.figure.savefig(sys.argv[1], dpi=70)
