"""What came of a run, beside its twin and beside what its protocol expects."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from workbench.bundle import Bundle, judgements, passed
from workbench.quantities import QUANTITIES

__all__ = ["experiment_verdict", "result"]


def result(bundle: Bundle) -> dict[str, Any] | None:
    """Return the numbers of a run that is complete, and its verdict; None before."""
    compared = bundle.manifest.compared
    if compared is None or not bundle.is_closed():
        return None
    real, twin = compared.real.model_dump(), compared.twin.model_dump()
    judged = judgements(bundle.manifest)
    return {
        "passed": passed(judged),
        "judged": [[one.mark, one.passed, *one.words] for one in judged],
        "rows": [
            [
                f"{one.name} [{one.unit}]" if one.unit else one.name,
                *(_number(one.factor * value, one.digits) for value in (real[key], twin[key])),
                _number(one.apart(real[key], twin[key]), one.digits, "+"),
            ]
            for key, one in QUANTITIES.items()
            if key in real
        ],
        "error": f"{compared.error_mm:.1f} mm",
        "report": bundle.view("report").exists(),
        "recording": bundle.view("recording").exists(),
    }


def experiment_verdict(bundles: Sequence[Bundle]) -> tuple[int, int]:
    """Return how many runs of an experiment were judged, and how many of them failed."""
    found = [passed(judgements(b.manifest)) for b in bundles if b.is_closed()]
    return sum(one is not None for one in found), found.count(False)


def _number(value: float, digits: int, sign: str = "") -> str:
    return f"{value:{sign}.{digits}f}" if math.isfinite(value) else "-"
