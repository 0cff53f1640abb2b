"""The certificate of derivatives."""

from __future__ import annotations

import json
from typing import Any

OF_THE_DISCRETE_MAP = "of the discrete map: "


class Certificate(dict[str, Any]):
    """How far derivatives can be trusted: the dict that the programs write, `["verdict"]` first.

    In an `if` it is true where the derivatives are those of the motion and can be trusted, so not
    where it has `discrete_map`: by fixed steps the derivatives after an impact, or a contact that is
    made or broken, are those of the map which the steps compute.
    """

    @classmethod
    def of_json(cls, text: str) -> Certificate:
        """Reads the JSON of one."""
        return cls(json.loads(text))

    @property
    def verdict(self) -> str:
        """ "trustworthy", or what is wrong; of the discrete map that is what it begins with."""
        return str(self["verdict"])

    @property
    def trustworthy(self) -> bool:
        """Whether these are derivatives of the motion, away from kinks and jumps."""
        return self.verdict == "trustworthy"

    @property
    def discrete_map(self) -> bool:
        """Whether these are derivatives of the discrete map and not of the motion."""
        return bool(self["discrete_map"])

    @property
    def verdict_of_map(self) -> str:
        """The verdict without its prefix: "trustworthy" where the map has no kink or jump nearby."""
        verdict = self.verdict
        return verdict[len(OF_THE_DISCRETE_MAP) :] if self.discrete_map else verdict

    @property
    def advice(self) -> str:
        """What gives the derivative of the motion; empty where this is it."""
        return str(self["advice"])

    def __bool__(self) -> bool:
        return self.trustworthy
