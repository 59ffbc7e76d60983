"""Whether a run passes: its results beside what its protocol expects."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from workbench.bundle.manifest import Manifest
from workbench.quantities import QUANTITIES, DisplayedQuantity

__all__ = ["Judgement", "judgements", "passed"]

_ERROR = DisplayedQuantity("Error of the twin", "mm", 1.0, 1)


@dataclass(frozen=True)
class Judgement:
    """One result beside the range that was expected.

    Args:
        name: of the result, `distance_m`.
        value: in its unit; NaN where it was not measured.
        low: least value expected; None where there is none.
        high: greatest value expected.
    """

    name: str
    value: float
    low: float | None
    high: float | None

    @property
    def quantity(self) -> DisplayedQuantity:
        """Return how the result is called and shown."""
        return _ERROR if self.name == "error_mm" else QUANTITIES[self.name]

    @property
    def passed(self) -> bool:
        """Return whether the value lies in the range; one that was not measured does not."""
        return (
            (self.low is None or self.value >= self.low)
            and (self.high is None or self.value <= self.high)
            and math.isfinite(self.value)
        )

    @property
    def mark(self) -> str:
        """Return `pass` or `FAIL`."""
        return "pass" if self.passed else "FAIL"

    def as_json(self) -> dict[str, Any]:
        """Return it for `--json`; None where it was not measured."""
        value = self.value if math.isfinite(self.value) else None
        ends = {"value": value, "low": self.low, "high": self.high}
        return {"name": self.name, **ends, "passed": self.passed}

    @property
    def words(self) -> tuple[str, str, str]:
        """Return what was looked at, what came, and what was expected, with units."""
        label = self.quantity
        came = label.text(self.value) if math.isfinite(self.value) else "not measured"
        if self.low is None and self.high is not None:
            expected = f"at most {label.text(self.high)}"
        elif self.high is None and self.low is not None:
            expected = f"at least {label.text(self.low)}"
        else:
            expected = f"{label.number(self.low or 0.0)} to {label.text(self.high or 0.0)}"
        return label.name, came, expected


def judgements(manifest: Manifest) -> tuple[Judgement, ...]:
    """Return a run's results beside what its protocol expects; empty where it expects nothing."""
    asked, compared = manifest.asked, manifest.compared
    if asked is None or not asked.expect:
        return ()
    values = (
        {} if compared is None else {**compared.real.model_dump(), "error_mm": compared.error_mm}
    )
    return tuple(
        Judgement(name, float(values.get(name, math.nan)), *ends)
        for name, ends in asked.expect.items()
    )


def passed(found: Sequence[Judgement]) -> bool | None:
    """Return whether all passed; None where nothing was expected."""
    return all(one.passed for one in found) if found else None
