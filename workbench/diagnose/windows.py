"""Windows of one hop each, that begin while the foot stands, as they are found in a track."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from workbench.diagnose.noise import Noise, whitened
from workbench.fit import MeasuredRun
from workbench.motion import FOOT, ROTOR_ANGLE
from workbench.sim import SAMPLE_RATE_HZ, STANCE
from workbench.timeseries import TimeSeries
from workbench.tracking.glitches import spikes

__all__ = ["Windows", "windows_in"]

Array = NDArray[np.float64]

_LENGTH_S = 0.36  # a turn of the rotor at 17.5 rad/s, and so a hop
_MOST = 8  # of a run
_SETTLED_S = 2.0  # of a run before its first window
_AROUND = 4  # samples before and after, all of them in the stance
_LIFTED_M = 3e-4  # the ground is soft: a foot that stands sinks in and rises by less
_STILL = 3.0  # deviations of the noise
_GLITCH = 8.0  # deviations of the noise from the median of the samples around


@dataclass(frozen=True, eq=False)
class Windows:
    """The windows of one hop.

    Args:
        begins: (w,) samples of the run that they begin at.
        values: (w, n, c) measured; the first sample is where they begin.
        seen: (w, n, c) which count; the first sample does not, for the one before it is missing.
        expected: (w, s) stances as far as they are seen.
        noise: of the run.
    """

    begins: tuple[int, ...]
    values: Array
    seen: NDArray[np.bool_]
    expected: Array
    noise: Noise

    def __len__(self) -> int:
        """Return how many there are."""
        return len(self.begins)

    @property
    def count(self) -> int:
        """Return how many samples a window has."""
        return self.values.shape[1]

    @property
    def times(self) -> Array:
        """Return when they were taken, (w n,) [s]."""
        return np.concatenate([at + np.arange(self.count) for at in self.begins]) / SAMPLE_RATE_HZ

    @property
    def rows(self) -> tuple[Array, Array, NDArray[np.bool_]]:
        """Return times (w n,), values and which count (w n, c)."""
        width = self.values.shape[2]
        return self.times, self.values.reshape(-1, width), self.seen.reshape(-1, width)

    def until(self, end: float) -> Windows:
        """Return those that begin up to a time [s]."""
        kept = sum(at / SAMPLE_RATE_HZ <= end for at in self.begins)
        parts = (self.values[:kept], self.seen[:kept], self.expected[:kept])
        return Windows(self.begins[:kept], *parts, self.noise)

    def chosen(self, at: NDArray[np.int_]) -> Windows:
        """Return some of them."""
        begins = tuple(self.begins[i] for i in at)
        return Windows(begins, self.values[at], self.seen[at], self.expected[at], self.noise)

    def cut(self, count: int) -> Windows:
        """Return the same compared for fewer samples."""
        seen = self.seen.copy()
        seen[:, count:] = False
        return replace(self, seen=seen)

    def left(self, told: Array) -> Array:
        """Return what a prediction (w, n, c) leaves of each, (w,) noise deviations."""
        white = self.white(self.values - told)
        return np.sqrt(np.sum(white**2, axis=1) / np.maximum(self.seen.sum(axis=(1, 2)), 1))

    def white(self, change: Array) -> Array:
        """Return a change of the prediction, (w, n, c) or (w, n, c, k), whitened (w, n c[, k])."""
        rows = change.reshape(-1, *change.shape[2:])
        white = whitened(rows, self.seen.reshape(-1, self.seen.shape[2]), self.noise)
        return white.reshape(len(self), -1, *change.shape[3:])


def windows_in(run: MeasuredRun, noise: Noise) -> Windows | None:
    """Return the windows of a hop, evenly taken from its stances; None where it has none.

    A foot stands where it neither rises nor moves for a while.

    Args:
        run: of mode hop.
        noise: of its channels.
    """
    part = run.during(np.inf)
    values, count = np.nan_to_num(part.values), round(_LENGTH_S * SAMPLE_RATE_HZ) + 1
    wild = [
        spikes(part.times, np.where(ok, column, np.nan)[:, None], _GLITCH * sigma)
        for column, ok, sigma in zip(values.T, part.valid.T, noise.sigma, strict=True)
    ]
    seen = part.valid & np.isfinite(part.values) & ~np.column_stack(wild)
    chosen = _spaced(_stances(run, part, seen, noise), count, len(values))
    if not chosen:
        return None
    rows = np.array([at + np.arange(count) for at in chosen])
    taken = seen[rows]
    taken[:, 0] = False
    around = [slice(at - _AROUND, at + _AROUND + 1) for at in chosen]
    expected = np.zeros((len(chosen), len(STANCE)))
    expected[:, 0] = [np.median(values[one, part.names.index(FOOT[0])]) for one in around]
    rest = run.at_rest()[run.places.index(FOOT[0])]
    expected[:, 0] -= rest if np.isfinite(rest) else 0.0
    expected[:, -1] = [np.median(values[one, part.names.index(ROTOR_ANGLE)]) for one in around]
    return Windows(tuple(chosen), values[rows], taken, expected, noise)


def _stances(
    run: MeasuredRun, part: TimeSeries, seen: NDArray[np.bool_], noise: Noise
) -> NDArray[np.int_]:
    """Return the middle sample of each stance, (k,)."""
    axes = [part.names.index(FOOT[0]), part.names.index(FOOT[2])]
    width = 2 * _AROUND + 1
    foot = np.lib.stride_tricks.sliding_window_view(part.values[:, axes], width, axis=0)
    there = np.lib.stride_tricks.sliding_window_view(seen, width, axis=0).all(axis=(1, 2))
    still = np.abs(foot[:, 0] - np.median(foot[:, 0], axis=1)[:, None]).max(axis=1)
    rest = run.at_rest()[run.places.index(FOOT[2])]
    low = np.median(foot[:, 1], axis=1) < rest + _LIFTED_M
    stands = there & low & (still < _STILL * noise.sigma[axes[0]])
    edges = np.flatnonzero(np.diff(np.pad(stands.astype(int), 1)))
    middles = (edges[::2] + edges[1::2] - 1) // 2 + _AROUND
    return middles[middles >= _SETTLED_S * SAMPLE_RATE_HZ]


def _spaced(middles: NDArray[np.int_], count: int, samples: int) -> list[int]:
    """Return moments so far apart that no window reaches the next, evenly taken."""
    chosen: list[int] = []
    for at in map(int, middles):
        if at + count <= samples and (not chosen or at >= chosen[-1] + count):
            chosen.append(at)
    even = np.linspace(0, len(chosen) - 1, min(_MOST, len(chosen))).round().astype(int)
    return [chosen[i] for i in even]
