"""Checks of a take against its own numbers, in any format.

Each finding is a warning with value and frame. Samples that repeat the one before because nothing
new was measured no longer count as seen.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from workbench.tracking.missing import runs
from workbench.tracking.take import BodyTake, SampleStatus, Take, known

__all__ = ["apart", "checked"]

_LONGEST_HOLD = 8  # samples; a longer repeat is a frozen body, or one that truly stands still
_LEAST_HOLDS = 3
_LEAST_SHARE = 0.02  # real takes of bodies that were seen repeat 1 sample in 1000
_EVEN = 0.9  # of the holds come at the usual interval; chance repeats of rounded numbers do not
_APART_M = 5e-3  # real solved markers lie within 0.2 mm of the measured ones
_LOOKED_AT = 2000  # samples


class _Held(NamedTuple):
    """(n,) True where a body repeats the sample before, and how many it has that are new."""

    mask: NDArray[np.bool_]
    new: int


def checked(take: Take) -> Take:
    """Return a take whose held samples do not count as seen, with warnings of contradictions."""
    held = {name: found for name, body in take.bodies.items() if (found := _held(body)) is not None}
    bodies = {
        name: body.without(held[name].mask, SampleStatus.FROZEN) if name in held else body
        for name, body in take.bodies.items()
    }
    warnings = [*_on_holds(take, held), *_on_solved(take.bodies)]
    if not warnings:
        return take
    return replace(take, bodies=bodies, warnings=(*take.warnings, *warnings))


def apart(solved: NDArray[np.float64], measured: NDArray[np.float64]) -> float:
    """Return the median distance of solved from measured markers [m], NaN if none.

    Args:
        solved: (n, m, 3) [m].
        measured: (n, m, 3) [m], NaN where not seen.
    """
    some = slice(None, None, max(1, len(solved) // _LOOKED_AT))
    off = np.linalg.norm(measured[some] - solved[some], axis=2)
    off = off[np.isfinite(off)]
    return float(np.median(off)) if len(off) else float("nan")


def _held(body: BodyTake) -> _Held | None:
    """Return the samples of a body that is sampled and held, None where it is not.

    Holds are short and come evenly: every second sample, or every sixth. Numbers that are rounded
    repeat by chance, at odd intervals. Samples that are not given are passed over, so that a body
    at rest is one long repeat, however often it is out of sight.
    """
    values = body.measured.reshape(len(body.missing), -1)
    finite = np.isfinite(values)
    if not finite.any():
        values = np.hstack([body.position, body.quaternion])
        finite = np.isfinite(values)
    given = np.flatnonzero(finite.any(axis=1))
    alike = np.arange(1, len(given))
    for column in values.T:  # what differs in one of them is not looked at again
        before, after = column[given[alike - 1]], column[given[alike]]
        alike = alike[(before == after) | (np.isnan(before) & np.isnan(after))]
    repeat = np.zeros(len(given), dtype=np.bool_)
    repeat[alike] = True
    holds = [(start, stop) for start, stop in runs(repeat) if stop - start <= _LONGEST_HOLD]
    mask = np.zeros(len(values), dtype=np.bool_)
    for start, stop in holds:
        mask[given[start:stop]] = True
    new = int(np.count_nonzero(~repeat))
    if len(holds) < _LEAST_HOLDS or mask.sum() < _LEAST_SHARE * new:
        return None
    intervals = np.diff([given[start] for start, _ in holds])
    even = np.abs(intervals - np.median(intervals)) <= 1
    return _Held(mask, new) if even.mean() >= _EVEN else None


def _on_holds(take: Take, held: Mapping[str, _Held]) -> list[str]:
    warnings: list[str] = []
    for name, found in held.items():
        count = int(np.count_nonzero(found.mask))
        rate = take.rate_hz * found.new / (found.new + count)
        warnings.append(
            f"{name!r} repeats the sample before exactly in {count} samples at even intervals, "
            f"first at frame {take.indices[np.argmax(found.mask)]}: {rate:.4g} Hz in effect, "
            f"{take.rate_hz:g} Hz stated; the repeats count as not seen"
        )
    return warnings


def _on_solved(bodies: Mapping[str, BodyTake]) -> list[str]:
    warnings: list[str] = []
    for name, body in bodies.items():
        off = apart(body.solved, body.measured)
        if off > _APART_M:
            error = body.reported_error
            reported = np.nan if error is None else error[body.seen & known(error[:, None])]
            usual = float(np.median(reported)) if np.size(reported) else np.nan
            stated = (
                "" if np.isnan(usual) else f", the file states an error of {1e3 * usual:.1f} mm"
            )
            warnings.append(
                f"the solved markers of {name!r} lie {1e3 * off:.1f} mm (median) from the "
                f"measured ones{stated}: its model is not the body that was seen. The measured "
                "ones are followed; recipe 'thesis' follows the solved ones"
            )
    return warnings
