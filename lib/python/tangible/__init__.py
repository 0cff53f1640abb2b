"""Planar rigid-body dynamics with joints, contact and friction, whose gradients can be checked.

Scenes are those of the programs: a file, its JSON as a dict, or built with keyword arguments.
Units are SI, angles are in radians, x points right and y up.

    >>> import tangible
    >>> tangible.load_example()
    >>> scene = tangible.Scene(gravity=[0, -9.81], simulation={"stepping": "event", "duration": 1.0})
    >>> scene.add_body("ball", shape={"circle": {"radius": 0.1}}, mass=1.0, position=[0, 1.1],
    ...                restitution=0.8)
    >>> scene.add_body("floor", static=True, restitution=0.8,
    ...                shape={"half_plane": {"normal": [0, 1], "offset": 0}})
    >>> tangible.simulate(scene).final["ball/y"]
    >>> rollout = tangible.Rollout(scene, parameters=["bodies/ball/position/y"])
    >>> rollout.jacobian().parameters
"""

from ._core import TangibleError, __version__
from ._certificate import Certificate
from ._examples import load_example
from ._fit import FitResult, Residuals, fit
from ._plan import Motion, MpcResult, Plan, mpc, plan
from ._rollout import Jacobian, Rollout, Smoothing
from ._scene import Scene
from ._simulation import Simulation
from ._trajectory import Contacts, Events, Joints, Trajectory, simulate
from ._warning import TangibleWarning

__all__ = [
    "Certificate",
    "Contacts",
    "Events",
    "FitResult",
    "Jacobian",
    "Joints",
    "Motion",
    "MpcResult",
    "Plan",
    "Residuals",
    "Rollout",
    "Scene",
    "Simulation",
    "Smoothing",
    "TangibleError",
    "TangibleWarning",
    "Trajectory",
    "__version__",
    "fit",
    "load_example",
    "mpc",
    "plan",
    "simulate",
]

TangibleError.__doc__ = """What the engine refuses, or has not been able to do, in one line.

A mistake in a scene, a fit or a problem of control, a value that is not allowed, a run that ended early,
a fit that has not converged.

The line says where, what, what was expected and what was found: "chain.json: /bodies/3/mass: expected a
number > 0, got -1". It is a `ValueError`.
"""
