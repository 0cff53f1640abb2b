"""The certificate of derivatives."""

from __future__ import annotations

import json
import re
from typing import Any

OF_THE_DISCRETE_MAP = "of the discrete map: "
# How the engine names a place, one text for all: certify_place_inl.h.
_PLACE = re.compile(r"step (?P<step>\d+)(?:, t = (?P<time>[-+.0-9e]+) s)?")
_BODIES = re.compile(r"contact of (?P<first>[\w.-]+) and (?P<second>[\w.-]+)")
_JOINT = re.compile(r"joint (?P<name>[\w.-]+)")
_KINDS = (
    ("discontinuous: ", "discontinuous"),
    ("near a kink: ", "near_kink"),
    ("one-sided: ", "one_sided"),
)
_ADVICE = {
    "discontinuous": "the motion jumps here, so no derivative describes it: move the input, or the "
    "end of the run, away from the place, or compare runs on both sides",
    "near_kink": "derivatives on both sides differ: move the input away from the place, or take "
    "vjp(kinks=\"smoothed\"), the mean of the derivatives around",
    "one_sided": "the derivative holds for a change to one side alone: compare a difference to "
    "that side, or start from a value inside the range",
}


class Certificate(dict[str, Any]):
    """How far derivatives can be trusted: the dict that the programs write, `["verdict"]` first.

    In an `if` it is true where the derivatives are those of the motion and can be trusted, so not
    where it has `discrete_map`: by fixed steps the derivatives after an impact, a contact that is
    made or broken, or a slip that turns back, are those of the map which the steps compute. `print`
    shows it in words.
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
    def kind(self) -> str:
        """The worst that applies: "discontinuous", "near_kink", "one_sided", "discrete_map", or
        "trustworthy"."""
        verdict = self.verdict_of_map
        for start, kind in _KINDS:
            if verdict.startswith(start):
                return kind
        return "discrete_map" if self.discrete_map else "trustworthy"

    @property
    def _reason(self) -> str:
        """The text of the worst that applies, which names its place."""
        if self.kind == "discrete_map":
            return str(self["advice"])
        reason = self.verdict_of_map
        for start, _ in _KINDS[1:]:
            reason = reason.split(f"; {start}")[0]
        return "" if self.trustworthy else reason

    @property
    def step(self) -> int | None:
        """The step, from 0, of what `kind` names; None where it has none."""
        found = _PLACE.search(self._reason)
        return None if found is None else int(found["step"])

    @property
    def time(self) -> float | None:
        """Its time, s, with the six digits of the verdict; None where it has none."""
        found = _PLACE.search(self._reason)
        return None if found is None or found["time"] is None else float(found["time"])

    @property
    def bodies(self) -> tuple[str, ...]:
        """The two bodies of the contact that `kind` is about; empty where it is none of a contact."""
        found = _BODIES.search(self._reason)
        return () if found is None else (found["first"], found["second"])

    @property
    def joint(self) -> str | None:
        """The joint whose limit or friction `kind` is about."""
        found = _JOINT.search(self._reason)
        return None if found is None else found["name"]

    @property
    def advice(self) -> str:
        """What to try, in a sentence; empty where the derivatives can be trusted."""
        parts = [str(self["advice"])] if self["advice"] else []
        kind = self.kind
        if "coordinates are too large" in self._reason:
            parts.append("contacts are decided by rounding: move the scene nearer to the origin")
        elif "linear system" in self._reason:
            parts.append("the equations of a step are nearly singular: take masses and stiffnesses "
                         "that differ less, or leave out supports that others make redundant")
        elif kind in _ADVICE:
            parts.append(_ADVICE[kind])
        return "; ".join(parts)

    @property
    def radius(self) -> dict[str, dict[str, float | None]]:
        """How far each parameter may be changed, to first order, until a contact, an event or the
        order of two events is another: `{"bodies/ball/mass": {"down": 0.2, "up": None}}`, None where
        none changes within the parameter's range. Empty where it was not asked for."""
        return {
            path: {side: both[side] for side in ("down", "up")}
            for path, both in self.get("radius", {}).items()
        }

    @property
    def growth(self) -> float | None:
        """By how much the run multiplies the largest of all small changes of its start, in units of
        the scene's size: 1.6 for a free flight, very large where the motion is chaotic. None where it
        was not asked for."""
        value = self.get("growth")
        return None if value is None else float(value)

    @property
    def words(self) -> str:
        """The verdict in plain words."""
        if self.trustworthy:
            return "trustworthy: the derivative of the motion, away from kinks and jumps"
        rows = re.match(r"near a kink: kink of (\d+) rows", self.verdict_of_map)
        if rows is None:
            return self.verdict
        place = self["margin_where"]
        count = int(rows[1])
        times = "once" if count == 1 else f"{count} times"
        prefix = OF_THE_DISCRETE_MAP if self.discrete_map else ""
        return (
            f"{prefix}near a kink: during the run a contact or limit is {times} exactly where it "
            f"changes (between resting, sliding and parting), at {place}"
        )

    def __bool__(self) -> bool:
        return self.trustworthy

    def __str__(self) -> str:
        advice = self.advice
        return f"{self.words} ({advice})" if advice else self.words

    def __repr__(self) -> str:
        return f"Certificate({self.verdict!r})"
