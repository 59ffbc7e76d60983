"""The default cleaning: honest about what was seen, gentle to what was."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.signal import butter, sosfiltfilt

from workbench.errors import InputError
from workbench.motion import FOOT, PITCH, ROTOR, TOP
from workbench.timeseries import TimeSeries
from workbench.tracking.bodies import RawBody, RawPoints
from workbench.tracking.glitches import bursts, out_of_reach, spikes
from workbench.tracking.missing import runs
from workbench.tracking.recipe import BodyReport, CleaningReport
from workbench.tracking.take import known

__all__ = ["default"]

_LONGEST_FILL_S = 0.1
_ORDER = 4
_CUTOFF_HZ = 25.0
_PADDING = 15  # scipy's own for two second-order sections
_MOST_GRID = 2_000_000
_FOOT_TOP_M = (0.16, 0.6)  # Appendix C
_TOP_ROTOR_M = (0.01, 0.2)  # Appendix C
_NAMES = {"foot": FOOT, "top": TOP, "rotor": ROTOR}


def default(points: RawPoints) -> tuple[TimeSeries, CleaningReport]:
    """Reject glitches, fill short gaps, filter what hangs together; long gaps stay NaN.

    * Glitches: strays from the running median, bursts faster than 5 m/s, and the distance rules of
      Appendix C (0.16 to 0.6 m from foot to T, 0.01 to 0.2 m from T to rotor). A distance rule that
      more than half of the samples break is not about glitches: it is left out, with a warning.
    * Gaps up to 0.1 s are filled by cubic splines. Filled samples have values, but are not valid.
    * The low-pass runs forth and back (no delay), order 4 at 25 Hz: hopping shocks have content
      well above the thesis' 9 Hz, marker noise lies mostly above 25 Hz. It never runs across a gap
      that stays open or a jump of the frame index; stretches of up to 15 samples stay unfiltered.

    Raises:
        InputError: when the frame index jumps so far that no even grid can hold the take.
    """
    advancing = _advancing(points.times)
    times = points.times[advancing]
    grid = _grid(times, points.rate_hz)
    warnings: list[str] = []
    raw = {role: body.position[advancing] for role, body in points.bodies.items()}
    rejected = _reject(times, raw, warnings)
    columns: dict[str, NDArray[np.float64]] = {}
    valid: dict[str, NDArray[np.bool_]] = {}
    reports: dict[str, BodyReport] = {}
    for role, body in points.bodies.items():
        believed = np.where(rejected[role][:, None], np.nan, raw[role])
        path, seen = _fill(times, believed, grid, points.rate_hz)
        columns.update(zip(_NAMES[role], path.T, strict=True))
        valid.update(dict.fromkeys(_NAMES[role], seen))
        reports[role] = _report(body, path, seen, rejected[role])
    pitch = _pitch(points, advancing, rejected["foot"])
    if pitch is not None:
        values, valid[PITCH] = _fill(times, pitch[:, None], grid, points.rate_hz)
        columns[PITCH] = values[:, 0]
    columns, unfiltered, words = _smooth(columns, points.rate_hz)
    report = CleaningReport("default", reports, words, unfiltered, warnings=tuple(warnings))
    return TimeSeries.of(grid, columns, valid), report


def _advancing(times: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Tell samples later than all before; rewritten files repeat frames."""
    given = np.where(np.isfinite(times), times, -np.inf)
    before = np.concatenate(([-np.inf], np.maximum.accumulate(given)[:-1]))
    return given > before


def _reject(
    times: NDArray[np.float64], raw: dict[str, NDArray[np.float64]], warnings: list[str]
) -> dict[str, NDArray[np.bool_]]:
    rejected: dict[str, NDArray[np.bool_]] = {}
    clean: dict[str, NDArray[np.float64]] = {}
    for role, path in raw.items():
        found = spikes(path)
        found |= bursts(times, np.where(found[:, None], np.nan, path))
        rejected[role], clean[role] = found, np.where(found[:, None], np.nan, path)
    for role, anchor, allowed in (("top", "foot", _FOOT_TOP_M), ("rotor", "top", _TOP_ROTOR_M)):
        far = out_of_reach(clean[role], clean[anchor], allowed)
        both = known(clean[role] + clean[anchor])
        if far.sum() > 0.5 * both.sum():
            warnings.append(
                f"{far.sum()} of {both.sum()} distances {anchor}-{role} lie outside "
                f"{allowed[0]:g} to {allowed[1]:g} m; that rule is left out. Are the bodies right?"
            )
            continue
        rejected[role] = rejected[role] | far
        clean[role] = np.where(far[:, None], np.nan, clean[role])
    return rejected


def _grid(times: NDArray[np.float64], rate: float) -> NDArray[np.float64]:
    steps = round((times[-1] - times[0]) * rate)
    if steps > _MOST_GRID:
        raise InputError(
            f"the take has {len(times)} samples over {times[-1] - times[0]:.6g} s at {rate:g} Hz: "
            "the frame index jumps too far; export the part that matters"
        )
    return times[0] + np.arange(steps + 1) / rate


def _fill(
    times: NDArray[np.float64], values: NDArray[np.float64], grid: NDArray[np.float64], rate: float
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Return values (k, d) on the grid, NaN in long gaps, and (k,) where one was really seen."""
    out = np.full((len(grid), values.shape[1]), np.nan)
    seen = np.zeros(len(grid), dtype=bool)
    sure = np.flatnonzero(known(values))
    long = np.diff(times[sure]) > _LONGEST_FILL_S + 1.001 / rate
    for piece in np.split(sure, np.flatnonzero(long) + 1):
        if len(piece) == 0:
            continue
        t, slack = times[piece], 0.01 / rate
        inside = (grid >= t[0] - slack) & (grid <= t[-1] + slack)
        out[inside] = _spline(t, values[piece], np.clip(grid[inside], t[0], t[-1]))
        near = np.abs(t[_nearest(t, grid[inside])] - grid[inside]) < 0.6 / rate
        seen[inside] = near
    return out, seen


def _spline(
    t: NDArray[np.float64], values: NDArray[np.float64], at: NDArray[np.float64]
) -> NDArray[np.float64]:
    if len(t) >= 4:
        return CubicSpline(t, values)(at)
    return np.column_stack([np.interp(at, t, column) for column in values.T])


def _nearest(t: NDArray[np.float64], at: NDArray[np.float64]) -> NDArray[np.intp]:
    if len(t) == 1:
        return np.zeros(len(at), dtype=np.intp)
    right = np.clip(np.searchsorted(t, at), 1, len(t) - 1)
    return np.where(at - t[right - 1] < t[right] - at, right - 1, right)


def _report(
    body: RawBody,
    path: NDArray[np.float64],
    seen: NDArray[np.bool_],
    rejected: NDArray[np.bool_],
) -> BodyReport:
    given = known(path)
    return BodyReport(
        source=body.source,
        filled=int(np.count_nonzero(given & ~seen)),
        rejected=int(np.count_nonzero(rejected)),
        missing_left=int(np.count_nonzero(~given)),
    )


def _pitch(
    points: RawPoints, advancing: NDArray[np.bool_], rejected: NDArray[np.bool_]
) -> NDArray[np.float64] | None:
    """Return the foot's pitch, (n,) [rad], where the take tells it."""
    if points.foot.pitch is None:
        return None
    pitch = np.where(rejected, np.nan, points.foot.pitch[advancing])
    given = np.isfinite(pitch)
    pitch[given] = np.unwrap(pitch[given])
    return pitch


def _smooth(
    columns: dict[str, NDArray[np.float64]], rate: float
) -> tuple[dict[str, NDArray[np.float64]], int, str]:
    """Low-pass each stretch of finite samples.

    Returns:
        The columns, how many samples lie in stretches too short for it, the filter in words.
    """
    cutoff = min(_CUTOFF_HZ, 0.4 * rate)
    sos = butter(_ORDER, cutoff, fs=rate, output="sos")
    out: dict[str, NDArray[np.float64]] = {}
    unfiltered = 0
    for name, column in columns.items():
        smooth = column.copy()
        for start, stop in runs(np.isfinite(column)):
            if stop - start > _PADDING:
                smooth[start:stop] = sosfiltfilt(sos, column[start:stop], padlen=_PADDING)
            else:
                unfiltered += stop - start
        out[name] = smooth
    words = f"Butterworth order {_ORDER} at {cutoff:g} Hz, forth and back, per stretch"
    return out, unfiltered, words
