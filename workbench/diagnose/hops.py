"""The hops after the compared seconds: nobody can foretell them one by one, only their kind."""

from __future__ import annotations

from typing import NamedTuple

from markupsafe import Markup

from workbench.diagnose.diagnosis import Diagnosis
from workbench.diagnose.events import EventTest
from workbench.diagnose.hopper import HopperRig
from workbench.diagnose.proof import Errors
from workbench.diagnose.rig import Rig
from workbench.diagnose.wording import digits
from workbench.review.page import table

__all__ = ["HopsLeft", "hop_table", "hops_left"]

_SHOWN = {
    "period_s": ("time to the next [s]", 1.0),
    "apex_m": ("height [mm]", 1000.0),
    "contact_s": ("time on the ground [s]", 1.0),
    "stride_m": ("way forward [mm]", 1000.0),
}
"""Property -> its heading, and the factor to its unit there."""
_WORDS = (
    "Mean over the hops of runs held out, after the seconds that were compared sample by sample. "
    "Off: in standard errors of measured and simulated mean together; within 3 may be chance."
)


class HopsLeft(NamedTuple):
    """The later hops of one run held out, beside those of two models.

    Args:
        run: its name.
        since: from when on [s].
        base: one test for each property of a hop; none where too few hopped.
        extended: the same of the extended model; none without one.
    """

    run: str
    since: float
    base: tuple[EventTest, ...]
    extended: tuple[EventTest, ...]


def hops_left(found: Diagnosis) -> list[HopsLeft]:
    """Return how the later hops of each run held out differ from those of the models."""
    if not isinstance(found.rig, HopperRig):
        return []
    left = []
    for k, run in enumerate(found.rig.runs):
        if run.mode == "hop" and run.name in found.held_out:
            extended = () if found.proof is None else _events(
                found.extended, k, run.name, found.proof.extended
            )  # fmt: skip
            base = _events(found.rig, k, run.name, found.errors)
            left.append(HopsLeft(run.name, float(run.times[-1]), base, extended))
    return [one for one in left if one.base or one.extended]


def hop_table(found: Diagnosis) -> Markup:
    """Return them as a table, nothing where none hopped."""
    left = hops_left(found)
    if not left:
        return Markup()
    models = ("Base", "Extended") if any(one.extended for one in left) else ("Base",)
    heads = ("Run", "Of a hop", "Measured", *(h for name in models for h in (name, "Off")))
    rows = [row for one in left for row in _rows(one, len(models))]
    return Markup("<p>{}</p>").format(_WORDS) + table(rows, heads)


def _events(rig: Rig | None, k: int, name: str, errors: Errors) -> tuple[EventTest, ...]:
    return rig.events(k, errors.values[name]) if isinstance(rig, HopperRig) else ()


def _rows(left: HopsLeft, models: int) -> list[tuple[str, ...]]:
    told = [{test.name: test for test in tests} for tests in (left.base, left.extended)][:models]
    rows = []
    for name, (heading, factor) in _SHOWN.items():
        measured = next(tests[name].measured for tests in told if tests)
        cells = [
            cell
            for tests in told
            for cell in (
                (digits(factor * tests[name].simulated), f"{tests[name].apart:+.1f}")
                if tests else ("too few hops", "")
            )
        ]  # fmt: skip
        rows.append(
            (f"{left.run} from {left.since:.1f} s", heading, digits(factor * measured), *cells)
        )
    return rows
