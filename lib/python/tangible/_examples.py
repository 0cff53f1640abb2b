"""Scenes that the package brings along."""

from __future__ import annotations

import json
from pathlib import Path
from typing import overload

from ._plain import text
from ._scene import Scene

_FOLDER = Path(__file__).parent / "scenes"


@overload
def load_example() -> list[str]: ...
@overload
def load_example(name: str) -> Scene: ...
def load_example(name: str | None = None) -> Scene | list[str]:
    """A small scene to begin with, or without a name the names of all.

        tangible.load_example()                  # ['bouncing_ball', 'cart_pole', ...]
        tangible.simulate(tangible.load_example("bouncing_ball")).plot()

    All are in SI units and stepped by events: `bouncing_ball` (a ball of 0.5 kg dropped from 1 m),
    `cart_pole` (with the control "joints/rail/effort", N), `chain_hit_by_ball` (four links, hit from
    the side), `double_pendulum`, `sliding_block` (which friction stops; with the control
    "forces/push/force/x", N).

    Args:
        name: One of the names.

    Raises:
        ValueError, TypeError: What is no name of one.
    """
    known = sorted(file.stem for file in _FOLDER.glob("*.json"))
    if name is None:
        return known
    if text(name, "name", f"one of {', '.join(known)}") not in known:
        raise ValueError(f"name: expected one of {', '.join(known)}, got {name!r}")
    return Scene(json.loads((_FOLDER / f"{name}.json").read_text(encoding="utf-8")))
