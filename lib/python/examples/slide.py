"""Friction from a slide: scipy's least squares with exact residuals and Jacobians."""

import sys

import numpy as np
import scipy.optimize
import tangible
from numpy.typing import NDArray

scene = tangible.Scene(simulation={"stepping": "event", "dt": 0.02, "duration": 1.0})
scene.add_body(
    "box", shape={"box": {"size": [0.2, 0.1]}}, mass=1.0, position=[0, 0.05], velocity=[2, 0]
)
scene.add_body("floor", static=True, shape={"half_plane": {"normal": [0, 1], "offset": 0}})
scene.add_pair("box", "floor", friction=0.5)
paths = ["pairs/box:floor/friction", "bodies/box/velocity/x"]
steps = range(0, 51, 5)
rollout = tangible.Rollout(scene, paths, records=list(steps))
truth = np.array([0.31, 2.2])
sigma = 1e-3
observed = rollout(truth)[:, 0] + sigma * np.random.default_rng(1).normal(size=len(steps))


def residuals(p: NDArray[np.float64]) -> NDArray[np.float64]:
    return (rollout(p)[:, 0] - observed) / sigma


def derivatives(p: NDArray[np.float64]) -> NDArray[np.float64]:
    return rollout.jacobian(p).parameters[:, 0] / sigma


start = rollout.default_parameters
bounds = ([0.0, 0.0], [2.0, 10.0])
fit = scipy.optimize.least_squares(residuals, start, jac=derivatives, bounds=bounds)
deviations = np.sqrt(np.diag(np.linalg.inv(fit.jac.T @ fit.jac)))
for path, value, deviation, true in zip(paths, fit.x, deviations, truth):
    print(f"{path}: {value:.5f} +- {deviation:.5f} (true {true})")
assert np.all(np.abs(fit.x - truth) < 4.0 * deviations) and deviations[0] < 2e-3

if len(sys.argv) > 1:  # the picture: the fitted slide and what was observed
    axes = tangible.simulate(scene, dict(zip(paths, fit.x))).plot("box/x")
    axes.plot(0.1 * np.arange(11), observed, "o", mfc="none", label="observed")
    axes.legend()
    axes.figure.savefig(sys.argv[1], dpi=70)
