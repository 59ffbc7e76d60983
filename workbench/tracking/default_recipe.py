"""The default cleaning: glitches rejected, seen samples smoothed, long gaps left open."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from workbench.motion import FOOT, PITCH, ROTOR, TOP
from workbench.timeseries import TimeSeries
from workbench.tracking.bodies import RawPoints
from workbench.tracking.body_names import FOOT_TOP_M, TOP_ROTOR_M
from workbench.tracking.glitches import bursts, off_length, out_of_reach, spikes, strays
from workbench.tracking.recipe import BodyReport, Cleaned, CleaningReport, advancing
from workbench.tracking.resampling import ABSENT, even_grid, nearest_sample, on_grid, stretches
from workbench.tracking.smoothing import LEAST_SEEN, smooth_stretch
from workbench.tracking.take import SampleStatus, known, samples_of

__all__ = ["default"]

_LONGEST_FILL_S = 0.1
_CUTOFF_HZ = 30.0
_CUTOFF_SHARE = 0.4  # of a slow camera's rate
_ROUNDS = 3
_NEARBY = 30  # samples to either side that judge a stray
_RULE_FAILS = 0.5
_NAMES = {"foot": FOOT, "top": TOP, "rotor": ROTOR}

_Paths = dict[str, NDArray[np.float64]]
_Masks = dict[str, NDArray[np.bool_]]
_Reasons = dict[str, NDArray[np.int8]]


def default(points: RawPoints) -> Cleaned:
    """Reject glitches, then draw a smooth curve through what was seen; long gaps stay NaN.

    * Glitches: strays from the running median, bursts off the path, an arm from T to the
      rotor of unusual length, and the distance rules of Appendix C (0.16 to 0.6 m from foot to T,
      0.01 to 0.2 m from T to rotor). A distance rule that more than half of the samples break is
      not about glitches: it is left out, with a warning. Last, what strays from the smooth curve.
    * The low-pass has no delay and gain one half at 30 Hz. In simulated hops at 17 and 20 rad/s
      with 0.2 mm markers that leaves the least error of the foot, bias and noise together: at
      25 Hz landings are blurred by up to 0.7 mm, at 35 Hz T and rotor keep more noise.
      `benchmarks/cleaning.py` measures it. It uses only seen samples (`smoothing`).
    * Gaps up to 0.1 s get the curve's values. These are FILLED, and not valid. The curve never
      runs across a longer gap or a jump of the frame index; stretches with fewer than four seen
      samples stay as they are.

    Raises:
        InputError: when the frame index jumps so far that no even grid can hold the take.
    """
    keep = advancing(points.times)
    times = points.times[keep]
    grid = even_grid(times, points.rate_hz)
    source = nearest_sample(times, grid, points.rate_hz)
    raw = {role: samples_of(body.position, keep) for role, body in points.bodies.items()}
    rejected, warnings = _reject(times, raw)
    columns: dict[str, NDArray[np.float64]] = {}
    missing: _Reasons = {}
    raw_missing: _Reasons = {}
    unfiltered = 0
    for role, body in points.bodies.items():
        path = _without(raw[role], rejected[role])
        sampled = on_grid(times, path, grid, source, _LONGEST_FILL_S)
        path, pulling, short = _curve(sampled, points.rate_hz)
        rejected[role][source[pulling]] = True
        raw_missing[role] = _reasons(body.missing[keep], rejected[role])
        missing[role] = _on_grid(raw_missing[role], source, known(path))
        columns |= dict(zip(_NAMES[role], path.T, strict=True))
        unfiltered += 3 * short
    valid = {name: missing[role] == SampleStatus.SEEN for role in missing for name in _NAMES[role]}
    if points.foot.pitch is not None:
        pitch = _unwrapped(np.where(rejected["foot"], np.nan, points.foot.pitch[keep]))
        sampled = on_grid(times, pitch[:, None], grid, source, _LONGEST_FILL_S)
        valid[PITCH] = known(sampled)
        columns[PITCH] = _curve(sampled, points.rate_hz)[0][:, 0]
    report = CleaningReport(
        recipe="default",
        bodies={
            role: _report(body.source, missing[role], rejected[role])
            for role, body in points.bodies.items()
        },
        filter=f"smoothing curve of third differences, gain 1/2 at {_cutoff(points.rate_hz):g} Hz",
        unfiltered=unfiltered,
        warnings=warnings,
    )
    return Cleaned(TimeSeries.of(grid, columns, valid), missing, raw_missing, report)


def _reject(times: NDArray[np.float64], raw: _Paths) -> tuple[_Masks, tuple[str, ...]]:
    """Return the glitches by role, each (n,), and warnings of rules that do not fit the take."""

    def steady(path: NDArray[np.float64]) -> NDArray[np.float64]:
        # bursts first: spikes would nibble at their ends and hide the jumps
        path = _without(path, bursts(times, path))
        return _without(path, spikes(times, path))

    clean: _Paths = {role: steady(path) for role, path in raw.items()}
    off = off_length(clean["top"], clean["rotor"])
    clean |= {role: _without(clean[role], off) for role in ("top", "rotor")}
    warnings: list[str] = []
    for role, anchor, allowed in (("top", "foot", FOOT_TOP_M), ("rotor", "top", TOP_ROTOR_M)):
        far = out_of_reach(clean[role], clean[anchor], allowed)
        both = known(clean[role] + clean[anchor])
        if far.sum() > _RULE_FAILS * both.sum():
            warnings.append(
                f"{far.sum()} of {both.sum()} distances {anchor}-{role} lie outside "
                f"{allowed[0]:g} to {allowed[1]:g} m; that rule is left out. Are the bodies right?"
            )
            continue
        clean[role] = _without(clean[role], far)
    rejected = {role: known(path) & ~known(clean[role]) for role, path in raw.items()}
    return rejected, tuple(warnings)


def _without(path: NDArray[np.float64], mask: NDArray[np.bool_]) -> NDArray[np.float64]:
    return np.where(mask[:, None], np.nan, path) if mask.any() else path


def _curve(
    values: NDArray[np.float64], rate: float
) -> tuple[NDArray[np.float64], NDArray[np.bool_], int]:
    """Draw the curve, stretch by stretch, without the samples that pull it.

    Returns:
        The curve (k, d), NaN in long gaps; those samples (k,); and how many samples lie in
        stretches too short for a curve.
    """
    path, pulling, short = values.copy("K"), np.zeros(len(values), dtype=bool), 0
    seen = known(values)
    for start, stop in stretches(seen, round(_LONGEST_FILL_S * rate)):
        part = slice(start, stop)
        if np.count_nonzero(seen[part]) < LEAST_SEEN:
            short += int(np.count_nonzero(seen[part]))
        else:
            path[part], pulling[part] = _believed(values[part], seen[part], rate)
    return path, pulling, short


def _believed(
    values: NDArray[np.float64], seen: NDArray[np.bool_], rate: float
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Return the curve of one stretch without the samples that pull it, and those samples."""
    believed = seen.copy()
    path = smooth_stretch(values, believed, _cutoff(rate), rate)
    for _ in range(_ROUNDS):
        more = strays(values, path, believed, rate)
        if not more.any() or np.count_nonzero(believed & ~more) < LEAST_SEEN:
            break
        for at in np.flatnonzero(more):
            believed[_culprit(values, believed, int(at), rate)] = False
        path = smooth_stretch(values, believed, _cutoff(rate), rate)
    return path, seen & ~believed


def _culprit(values: NDArray[np.float64], believed: NDArray[np.bool_], at: int, rate: float) -> int:
    """Return which of a stray and its seen neighbours leaves the smoothest curve when left out.

    Beside a gap the curve follows a wrong sample, and its neighbour seems to stray.
    """
    near = slice(max(0, at - _NEARBY), at + _NEARBY + 1)
    seen, part = believed[near], values[near]
    index = np.flatnonzero(seen)
    place = int(np.searchsorted(index, at - near.start))
    candidates = index[max(0, place - 1) : place + 2]
    if len(index) <= LEAST_SEEN:
        return at
    left: list[float] = []
    for candidate in candidates:
        kept = seen.copy()
        kept[candidate] = False
        curve = smooth_stretch(part, kept, _cutoff(rate), rate)
        left.append(float(np.sum((part[kept] - curve[kept]) ** 2)))
    return near.start + int(candidates[np.argmin(left)])


def _cutoff(rate: float) -> float:
    return min(_CUTOFF_HZ, _CUTOFF_SHARE * rate)


def _unwrapped(angle: NDArray[np.float64]) -> NDArray[np.float64]:
    given = np.isfinite(angle)
    out = angle.copy()
    out[given] = np.unwrap(angle[given])
    return out


def _reasons(missing: NDArray[np.int8], rejected: NDArray[np.bool_]) -> NDArray[np.int8]:
    return np.where(rejected, SampleStatus.GLITCH, missing).astype(np.int8)


def _on_grid(
    reasons: NDArray[np.int8], source: NDArray[np.intp], given: NDArray[np.bool_]
) -> NDArray[np.int8]:
    """Return why a grid time has no seen sample, FILLED where there is a value all the same."""
    why = np.where(source == ABSENT, SampleStatus.BLANK, reasons[source])
    return np.where((why != SampleStatus.SEEN) & given, SampleStatus.FILLED, why).astype(np.int8)


def _report(source: str, missing: NDArray[np.int8], rejected: NDArray[np.bool_]) -> BodyReport:
    filled = missing == SampleStatus.FILLED
    return BodyReport(
        source=source,
        filled=int(np.count_nonzero(filled)),
        rejected=int(np.count_nonzero(rejected)),
        missing_left=int(np.count_nonzero(~filled & (missing != SampleStatus.SEEN))),
    )
