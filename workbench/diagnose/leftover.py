"""What base and extended model leave of the runs: over time, over frequency, by run and channel."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from workbench.diagnose.diagnosis import Diagnosis
from workbench.diagnose.noise import whitened
from workbench.diagnose.problem import Problem
from workbench.diagnose.proof import Errors
from workbench.diagnose.rig import Observed, Rig

__all__ = ["Density", "RunLeft", "Trace", "density", "left_by_run", "worst_traces"]

_ABOVE = 2.0  # times the density of the noise
_SEGMENTS = 3  # of a run, without their overlaps: fewer tell frequencies, more calm the curve


@dataclass(frozen=True, eq=False)
class RunLeft:
    """What is left of one run in noise deviations, root mean square by channel; 1 is noise alone.

    Args:
        run: its name.
        mode: what was done.
        role: `train` or `held_out`.
        before: channel -> what the base leaves; NaN where nothing was seen.
        after: channel -> what the extension leaves; empty where there is none.
    """

    run: str
    mode: str
    role: str
    before: dict[str, float]
    after: dict[str, float]


@dataclass(frozen=True, eq=False)
class Trace:
    """One channel of a run that judged, as measured and as predicted.

    Args:
        run: its name.
        channel: its name.
        unit: of the channel.
        times: (n,) [s].
        measured: (n,) NaN where it does not count.
        base: (n,) predicted.
        extended: (n,) predicted; None where there is no extension.
        sigma: standard deviation of the noise.
        memory: correlation of neighbouring samples of the noise.
    """

    run: str
    channel: str
    unit: str
    times: NDArray[np.float64]
    measured: NDArray[np.float64]
    base: NDArray[np.float64]
    extended: NDArray[np.float64] | None
    sigma: float
    memory: float

    @property
    def rate_hz(self) -> float:
        """Return how often it was sampled."""
        return 1 / float(np.mean(np.diff(self.times)))


@dataclass(frozen=True, eq=False)
class Density:
    """Amplitude density over frequency, in the channel's unit by the root of a hertz.

    Args:
        hz: (f,) frequencies.
        before: (f,) of what the base leaves.
        after: (f,) of what the extension leaves; None where there is none.
        noise: (f,) of the noise.
    """

    hz: NDArray[np.float64]
    before: NDArray[np.float64]
    after: NDArray[np.float64] | None
    noise: NDArray[np.float64]

    @property
    def peak_hz(self) -> float | None:
        """Return where what is left at last stands highest above the noise, None where it does not.

        Even noise alone reaches a little above its mean here and there.
        """
        above = (self.before if self.after is None else self.after) / self.noise
        return float(self.hz[np.argmax(above)]) if above.max() > _ABOVE else None


def left_by_run(found: Diagnosis) -> list[RunLeft]:
    """Return what is left of every run, those held out last.

    Runs that were fitted are judged by the fits of base and best hypothesis, those held out by the
    base and by the extended model's file.
    """
    seen = _seen(found, found.rig)
    fitted = found.refits.base.fit, found.answer.best.fit
    rows = []
    for at, k in enumerate(fitted[0].linear.runs):
        run = found.rig.runs[k]
        before, after = (
            _sizes(run, fit.residuals[at].reshape(run.values.shape), seen[k]) for fit in fitted
        )
        rows.append(RunLeft(run.name, run.mode, run.role, before, after if found.proof else {}))
    for k in _held_out(found):
        run = found.rig.runs[k]
        before, after = _judged(found, found.rig, found.errors, k), {}
        if found.proof is not None and found.extended is not None:
            after = _judged(found, found.extended, found.proof.extended, k)
        rows.append(RunLeft(run.name, run.mode, run.role, before, after))
    return rows


def worst_traces(found: Diagnosis, count: int) -> list[Trace]:
    """Return seen channels of the held-out run that the base misses most, the worst channel first.

    Args:
        found: the diagnosis.
        count: most channels.
    """
    worst = found.worst_held_out
    k = next(k for k in _held_out(found) if found.rig.runs[k].name == worst)
    traces = [_trace(found, k, channel) for channel in range(len(found.rig.runs[k].channels))]
    seen = [trace for trace in traces if np.isfinite(trace.measured).any()]
    return sorted(seen, key=_missed, reverse=True)[:count]


def density(trace: Trace) -> Density:
    """Return the spectra (Welch 1967) of what is left of a channel, and that of its noise.

    What was not seen is bridged by straight lines.
    """
    hz, before = _welch(trace, trace.base)
    after = None if trace.extended is None else _welch(trace, trace.extended)[1]
    turn = np.exp(-2j * np.pi * hz / trace.rate_hz)
    power = 2 * trace.sigma**2 * (1 - trace.memory**2) / trace.rate_hz
    return Density(hz, before, after, np.sqrt(power) / np.abs(1 - trace.memory * turn))


def _held_out(found: Diagnosis) -> list[int]:
    fitted, names = found.refits.base.fit.linear.runs, found.held_out
    return [k for k, run in enumerate(found.rig.runs) if run.name in names and k not in fitted]


def _seen(found: Diagnosis, rig: Rig) -> dict[int, NDArray[np.bool_]]:
    """Return by run which samples count, (n, c)."""
    return Problem(rig, found.layout, found.noise, ()).seen


def _judged(found: Diagnosis, rig: Rig, errors: Errors, k: int) -> dict[str, float]:
    """Return what a model leaves of a run held out; its rig says how much of a hop counts."""
    run, seen = rig.runs[k], _seen(found, rig)[k]
    apart = run.values - errors.predicted[run.name]
    return _sizes(run, whitened(apart, seen, found.noise[k]), seen)


def _sizes(run: Observed, left: NDArray[np.float64], seen: NDArray[np.bool_]) -> dict[str, float]:
    """Return the root mean square by channel of a whitened residual, (n, c)."""
    counts, squares = seen.sum(axis=0), np.sum(left**2, axis=0)
    sizes = np.sqrt(np.divide(squares, counts, out=np.full(len(counts), np.nan), where=counts > 0))
    return dict(zip(run.channels, sizes.tolist(), strict=True))


def _trace(found: Diagnosis, k: int, channel: int) -> Trace:
    """Return a channel of a run, for as long as both models are compared with it."""
    run, noise = found.rig.runs[k], found.noise[k]
    base, extended = found.errors.predicted[run.name], None
    if found.proof is not None:
        extended = found.proof.extended.predicted[run.name]
    end = len(base) if extended is None else min(len(base), len(extended))
    measured = np.where(_seen(found, found.rig)[k], run.values, np.nan)[:end, channel]
    return Trace(
        run.name, run.channels[channel], run.units[channel], run.times[:end], measured,
        base[:end, channel], None if extended is None else extended[:end, channel],
        float(noise.sigma[channel]), float(noise.memory[channel]),
    )  # fmt: skip


def _missed(trace: Trace) -> float:
    """Return what the base leaves of a channel in noise deviations, root mean square."""
    return float(np.sqrt(np.nanmean((trace.measured - trace.base) ** 2))) / trace.sigma


def _welch(
    trace: Trace, predicted: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return frequencies and amplitude density of what a prediction leaves, (f,) each."""
    apart = trace.measured - predicted
    seen = np.isfinite(apart)
    whole = np.interp(trace.times, trace.times[seen], apart[seen])
    length = max(len(whole) // _SEGMENTS, 2)
    hz, power = scipy.signal.welch(whole, trace.rate_hz, nperseg=length)
    return hz, np.sqrt(power)
