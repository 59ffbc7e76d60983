"""The thesis' cleaning, Appendix C, step by step, faults included.

Centroids of the solved markers; base = median of the foot's first 240 rows; NaN hold; glitch hold
by distance from the third sample on; Butterworth of order 10 at 9 Hz, forth and back.

Its faults are kept:

* solved markers stay finite while a body is lost, so the NaN hold hardly ever fires;
* the last frame is lost: the script counts frames - 0.5 of them;
* every row counts as one sample period, whatever its time or frame index;
* the base is taken before the NaN hold, and a NaN in the first row is never filled;
* glitches are found by the distances foot-T and T-rotor alone: the foot is never checked, and a
  glitch of T that was held can make the rotor be held too. The text (section 4.2) describes another
  rule, a threshold on the step from sample to sample, which the code does not use;
* forth and back makes the gain one half at 9 Hz, and hopping has content above that;
* afterwards every sample counts as valid; `Cleaned.missing` marks those that were not seen.

The script has 120 Hz fixed in it; here the take's rate is used. The term 0.015 times the forward
coordinate that Appendix C takes off the height belongs to its plot; it is not applied.
"""

from __future__ import annotations

import numpy as np
import scipy
from numpy.typing import NDArray

from workbench.errors import InputError
from workbench.motion import FOOT, ROTOR, TOP
from workbench.timeseries import TimeSeries
from workbench.tracking.bodies import RawPoints
from workbench.tracking.body_names import FOOT_TOP_M, TOP_ROTOR_M
from workbench.tracking.recipe import BodyReport, Cleaned, CleaningReport, advancing
from workbench.tracking.take import SampleStatus, known

__all__ = ["thesis"]

_BASE_ROWS = 240
_ORDER = 10
_CUTOFF_HZ = 9.0
_PADDING = 30  # MATLAB's filtfilt: 3 (filter length - 1); scipy's own default is 33


def thesis(points: RawPoints) -> Cleaned:
    """Clean as Appendix C does; the module's text lists the steps and their faults.

    Raises:
        InputError: fewer than 32 frames, or NaN where the script would turn everything into NaN.
    """
    raw = {role: body.solved[:-1] for role, body in points.bodies.items()}
    if len(raw["foot"]) <= _PADDING:
        raise InputError(
            f"recipe 'thesis' needs at least {_PADDING + 2} frames; there are {len(points.times)}"
        )
    base = np.median(raw["foot"][:_BASE_ROWS], axis=0)
    _refuse_nan(raw, base, points)
    held = {role: _hold_nan(path - base) for role, path in raw.items()}
    paths = {role: path for role, (path, _) in held.items()}
    far = {"foot": np.zeros(len(raw["foot"]), dtype=bool)}
    paths["top"], far["top"] = _hold_far(paths["top"], paths["foot"], FOOT_TOP_M)
    paths["rotor"], far["rotor"] = _hold_far(paths["rotor"], paths["top"], TOP_ROTOR_M)
    reports = {
        role: BodyReport(
            source=body.solved_source,
            held=int(np.count_nonzero(held[role][1]) + np.count_nonzero(far[role])),
            rejected=int(np.count_nonzero(far[role])),
        )
        for role, body in points.bodies.items()
    }
    report = CleaningReport(
        recipe="thesis",
        bodies=reports,
        filter=f"Butterworth order {_ORDER} at {_CUTOFF_HZ:g} Hz, forth and back",
        origin_m=(float(base[0]), float(base[1]), float(base[2])),
    )
    return Cleaned(_series(points, paths), *_reasons(points, far), report)


def _reasons(
    points: RawPoints, far: dict[str, NDArray[np.bool_]]
) -> tuple[dict[str, NDArray[np.int8]], dict[str, NDArray[np.int8]]]:
    """Return what was not seen by role, on the recipe's rows and on the take's own samples."""
    keep = advancing(points.times)
    missing: dict[str, NDArray[np.int8]] = {}
    raw_missing: dict[str, NDArray[np.int8]] = {}
    for role, body in points.bodies.items():
        reasons = body.missing.copy()
        reasons[:-1][far[role]] = SampleStatus.GLITCH
        raw_missing[role] = reasons[keep]
        held = reasons[:-1] != SampleStatus.SEEN
        missing[role] = np.where(held, SampleStatus.FILLED, SampleStatus.SEEN).astype(np.int8)
    return missing, raw_missing


def _refuse_nan(
    raw: dict[str, NDArray[np.float64]], base: NDArray[np.float64], points: RawPoints
) -> None:
    if np.isnan(base).any():
        row = int(np.flatnonzero(np.isnan(raw["foot"]).any(axis=1))[0])
        raise InputError(
            f"recipe 'thesis': {points.foot.name!r} has no position in frame row {row + 1} of the "
            f"first {_BASE_ROWS}, which makes the base NaN; use recipe 'default'"
        )
    for role, path in raw.items():
        if np.isnan(path[0]).any():
            raise InputError(
                f"recipe 'thesis': {points.bodies[role].name!r} has no position in the first "
                "frame, which its hold never fills; use recipe 'default'"
            )


def _hold_nan(path: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Repeat the sample before in place of NaN; return the path and where that was done."""
    given = known(path)
    last = np.maximum.accumulate(np.where(given, np.arange(len(path)), 0))
    return path[last], ~given


def _hold_far(
    path: NDArray[np.float64], anchor: NDArray[np.float64], allowed: tuple[float, float]
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Repeat the sample before where the anchor is too near or too far, from the third on."""
    distance = np.linalg.norm(path - anchor, axis=1)
    far = (distance < allowed[0]) | (distance > allowed[1])
    far[:2] = False
    last = np.maximum.accumulate(np.where(far, 0, np.arange(len(path))))
    return path[last], far


def _series(points: RawPoints, paths: dict[str, NDArray[np.float64]]) -> TimeSeries:
    if points.rate_hz <= 2 * _CUTOFF_HZ:
        raise InputError(f"recipe 'thesis' filters at 9 Hz; {points.rate_hz:g} Hz is too slow")
    sos = scipy.signal.butter(_ORDER, _CUTOFF_HZ, fs=points.rate_hz, output="sos")
    columns: dict[str, NDArray[np.float64]] = {}
    for names, role in ((FOOT, "foot"), (TOP, "top"), (ROTOR, "rotor")):
        smooth = scipy.signal.sosfiltfilt(sos, paths[role], axis=0, padlen=_PADDING)
        columns.update(zip(names, smooth.T, strict=True))
    times = points.times[0] + np.arange(len(paths["foot"])) / points.rate_hz
    return TimeSeries.of(times, columns)
