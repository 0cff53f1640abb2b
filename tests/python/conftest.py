"""Scenes that the tests share."""

from __future__ import annotations

from typing import Any

import pytest


def ball(stepping: str = "event", **simulation: Any) -> dict[str, Any]:
    """A ball that bounces once within 0.6 s."""
    return {
        "name": "ball",
        "bodies": [
            {
                "name": "ball",
                "shape": {"circle": {"radius": 0.1}},
                "mass": 1.2,
                "position": [0, 1.1],
                "velocity": [0.5, 0],
                "friction": 0.3,
                "restitution": 0.8,
            },
            {
                "name": "floor",
                "static": True,
                "friction": 0.3,
                "restitution": 0.8,
                "shape": {"half_plane": {"normal": [0, 1], "offset": 0}},
            },
        ],
        "forces": [{"name": "push", "body": "ball", "force": [0, 0], "torque": 0}],
        "simulation": {"dt": 0.01, "duration": 0.6, "stepping": stepping, **simulation},
    }


@pytest.fixture
def scene() -> dict[str, Any]:
    return ball()
