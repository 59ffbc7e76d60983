"""Measured runs of a rig file: its tables as runs of a mechanism."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy
from numpy.typing import NDArray

from workbench.errors import FileFaults, InputError, did_you_mean
from workbench.fit import Channel, Edit, JointStart, MjcfRun, total
from workbench.mechanism.causes import rig_effects
from workbench.mechanism.table import Table, require_even
from workbench.noise import white_noise
from workbench.schemas import Document, Location, RigFile, RigInput, RigStart

__all__ = ["MeasuredRigRun", "at_one_rate", "noise_of", "read_measured", "repeats_of", "run_of"]

Array = NDArray[np.float64]

_LEAST = 12  # samples of a run
_UNEVEN = 0.1  # of a sample: beyond, the values are interpolated
_DECIMALS = 9  # most of a stamp
_FINER = 8  # points of a curve from one stamp of an input to the next
_REST_S = 1.0  # the last of it shows where a joint was held
_WEAK = 10.0  # sigma: the prior of a start that was read from the run's own samples
_SAME = 1e-3  # of a sample rate
_AT_ZERO = 1e-6  # of a sample
_LEAST_REST = 30  # samples that show the noise's memory
_GLITCH = 3.0  # deviations beyond which a difference of rest counts no more
_RESTS = 3.0  # sigma that a scatter of rest may have
_MOST_MEMORY = 0.95


@dataclass(frozen=True, eq=False)
class MeasuredRigRun:
    """One run as its tables have it.

    Args:
        name: of the run, of no other in the file.
        times: (n,) [s], even; zero is where the simulation begins.
        values: (n, c) of the channels [SI], NaN where not seen.
        input_times: (m,) of the same clock [s].
        inputs: (m, i) in the order of the rig's inputs [SI].
    """

    name: str
    times: Array
    values: Array
    input_times: Array
    inputs: Array

    @property
    def sample_s(self) -> float:
        """Return the time from one sample to the next [s]."""
        return float((self.times[-1] - self.times[0]) / (len(self.times) - 1))

    @property
    def begun(self) -> NDArray[np.bool_]:
        """Return which samples are of the simulation, (n,)."""
        return self.times >= -_AT_ZERO * self.sample_s


def read_measured(file: Document[RigFile], k: int, name: str) -> MeasuredRigRun:
    """Read the tables of a run.

    Args:
        file: the rig file.
        k: number of the run in it.
        name: of the run.

    Raises:
        FileFaults: at the line of the rig file, for a file or column that is not there.
        InputError: with file and line, for data that cannot be used.
    """
    content, run = file.content, file.content.runs[k]
    table = _table(file, ("runs", k, "data"), run.data)
    apart = run.inputs is not None
    given = _table(file, ("runs", k, "inputs"), str(run.inputs)) if apart else table
    seen = {name: one.column or name for name, one in content.channels.items()}
    acted = {name: one.column or name for name, one in content.inputs.items()}
    _require(file, ("runs", k, "data"), run.data, table, [content.time, *seen.values()])
    where, what = ("inputs", str(run.inputs)) if apart else ("data", run.data)
    _require(file, ("runs", k, where), what, given, [content.time, *acted.values()])
    stamps = table.clock(content.time)
    if len(stamps) < _LEAST:
        raise InputError(f"{table.path}: {len(stamps)} samples; a run needs at least {_LEAST}")
    require_even(table, stamps)
    even = _even(stamps)
    begins = float(even[0]) if run.begins is None else run.begins
    if run.begins is not None and not stamps[0] <= begins <= stamps[-1]:
        words = f"begins: {begins:g} s is not within {stamps[0]:g} and {stamps[-1]:g} s of "
        raise FileFaults([file.fault(("runs", k, "begins"), f"{words}{table.path}")])
    input_times = given.clock(content.time)
    values = np.column_stack(
        [table.column(seen[name]) * one.scale for name, one in content.channels.items()]
    )
    inputs = np.column_stack(
        [np.zeros((len(input_times), 0))]
        + [given.known(acted[name]) * one.scale for name, one in content.inputs.items()]
    )
    if "free" in run.start.values():  # it starts where it is first seen
        begins = float(even[np.argmax(even >= begins - _UNEVEN * (even[1] - even[0]))])
    input_times, inputs = _finer(content.inputs, input_times - begins, inputs)
    found = MeasuredRigRun(name, even - begins, _on(even, stamps, values), input_times, inputs)
    if np.count_nonzero(found.begun) < _LEAST:
        count = np.count_nonzero(found.begun)
        words = f"begins: {table.path} has {count} samples after {begins:g} s; "
        fault = file.fault(("runs", k, "begins"), f"{words}a run needs at least {_LEAST}")
        raise FileFaults([fault])
    return found


def noise_of(
    channels: Mapping[str, float | None], runs: Sequence[MeasuredRigRun]
) -> list[float | None]:
    """Return each channel's noise as stated, or as the runs show it; None where neither says it.

    Args:
        channels: name -> standard deviation, where it is stated.
        runs: that show it, at rest before they begin where they rest, else in motion.
    """
    found: list[float | None] = []
    for c, stated in enumerate(channels.values()):
        guesses = [_noise(run, c) for run in runs]
        known = [one for one in guesses if np.isfinite(one)]
        found.append(stated or (float(np.median(known)) if known else None))
    return found


def _noise(run: MeasuredRigRun, c: int) -> float:
    """Return the noise of a channel in one run, at least that of its resolution; NaN of none."""
    values = run.values[:, c]
    steps = np.diff(np.unique(values[np.isfinite(values)]))
    if not len(steps):
        return np.nan
    found = white_noise(values[~run.begun], (2,), least=_LEAST_REST, sigma=_clipped)
    if np.isnan(found):  # it does not rest
        found = white_noise(values)
    return max(np.nan_to_num(found), float(steps.min()) / np.sqrt(12))


def _clipped(differences: Array) -> float:
    """Return their standard deviation, those far off clipped: surer at rest than a median."""
    far = _GLITCH * np.std(differences) * np.array([-1, 1])
    return float(np.std(np.clip(differences, *(np.median(differences) + far))))


def repeats_of(runs: Sequence[MeasuredRigRun], sigma: Mapping[int, float]) -> float:
    """Return how often samples of noise repeat one another at rest; 1 where nothing rests.

    Args:
        runs: with samples before they begin.
        sigma: channel's number -> its noise.
    """
    found = []
    for run in runs:
        for c, noise in sigma.items():
            rest = run.values[~run.begun, c]
            rest = rest - np.nanmedian(rest) if np.isfinite(rest).any() else rest
            pairs = np.isfinite(rest[:-1]) & np.isfinite(rest[1:])
            if pairs.sum() >= _LEAST_REST and 0 < np.nanstd(rest) < _RESTS * noise:
                here, after = rest[:-1][pairs], rest[1:][pairs]
                found.append(float(here @ after / (here @ here)))
    memory = min(max(float(np.median(found)), 0.0), _MOST_MEMORY) if found else 0.0
    return (1 + memory) / (1 - memory)


def at_one_rate(runs: Sequence[MeasuredRigRun]) -> list[MeasuredRigRun]:
    """Return the runs at the rate of the fastest; samples that a slower one misses are not seen.

    Raises:
        InputError: where a rate is no whole fraction of the fastest.
    """
    least = min(run.sample_s for run in runs)
    ratios = [run.sample_s / least for run in runs]
    if any(abs(ratio - round(ratio)) > _SAME * ratio for ratio in ratios):
        rates = ", ".join(f"{run.name} {1 / run.sample_s:g} Hz" for run in runs)
        raise InputError(
            f"the runs have {rates}; a rate must be the fastest or a whole fraction of it; resample"
        )
    return [_faster(run, round(ratio)) for run, ratio in zip(runs, ratios, strict=True)]


def run_of(
    file: Document[RigFile],
    k: int,
    measured: MeasuredRigRun,
    channels: Sequence[Channel],
    given: Mapping[Edit, float],
) -> MjcfRun:
    """Return a run of a mechanism.

    Args:
        file: the rig file.
        k: number of the run in it.
        measured: its tables.
        channels: with their noise.
        given: what is known of channels.

    Raises:
        FileFaults: for a start that its samples do not show.
    """
    run, begun = file.content.runs[k], measured.begun
    starts = {}
    for joint, start in run.start.items():
        try:
            starts[joint] = _start(file.content, joint, start, measured, channels, given)
        except InputError as error:
            words = f"start: {joint}: {error}"
            raise FileFaults([file.fault(("runs", k, "start", joint), words)]) from None
    return MjcfRun(
        measured.name, measured.times[begun], measured.values[begun], starts,
        measured.input_times, measured.inputs, run.late or 0.0,
    )  # fmt: skip


def _start(
    content: RigFile, joint: str, start: float | str | RigStart, measured: MeasuredRigRun,
    channels: Sequence[Channel], given: Mapping[Edit, float],
) -> JointStart:  # fmt: skip
    """Return where a joint starts; priors are as wide as what the channel may read wrong."""
    if isinstance(start, RigStart):
        return JointStart(start.position, start.tolerance, start.speed, start.speed_tolerance)
    if not isinstance(start, str):
        return JointStart(start)
    column, channel = next(
        (c, one) for c, one in enumerate(channels) if (one.of, one.owner) == ("position", joint)
    )
    offset, scale, delay = (
        total(given, field, channel.name) for field in ("offset", "scale", "delay")
    )
    values = (measured.values[:, column] - offset) / (1 + scale)
    sigma = float(channel.sigma or 0.0) / abs(1 + scale)
    found = _seen(start, measured, values, sigma)
    allowed = {
        one.effect: one.tolerance for one in rig_effects(content)
        if one.section == "channels" and channel.name in one.edit.owners
    }  # fmt: skip
    place = np.linalg.norm([
        found.position_deviation, allowed.get("offset", 0.0),
        allowed.get("gain", 0.0) * found.position, allowed.get("delay", 0.0) * found.speed,
    ])  # fmt: skip
    return replace(
        found, position=found.position + delay * found.speed, position_deviation=float(place)
    )


def _seen(start: str, measured: MeasuredRigRun, values: Array, sigma: float) -> JointStart:
    """Return what the samples say, (n,): of rest before the run, or of its first samples."""
    begun = measured.begun
    if start == "free":
        return JointStart.seen(measured.times[begun], values[begun], sigma)
    rest = values[~begun][-round(_REST_S / measured.sample_s) :]
    rest = rest[np.isfinite(rest)]
    if len(rest):
        return JointStart(float(np.median(rest)), max(sigma, float(np.std(rest))))
    known = values[begun][np.isfinite(values[begun])]
    if not len(known):
        raise InputError("none of its samples was seen")
    return JointStart(float(known[0]), _WEAK * sigma)


def _table(file: Document[RigFile], location: Location, named: str) -> Table:
    path = file.path.parent / named
    if not path.is_file():
        near = sorted(p.name for p in path.parent.glob("*.*")) if path.parent.is_dir() else []
        words = f"{location[-1]}: {path} is no file{did_you_mean(path.name, near)}"
        raise FileFaults([file.fault(location, words)])
    return Table(path)


def _require(
    file: Document[RigFile], location: Location, what: str, table: Table, wanted: Sequence[str]
) -> None:
    names = table.names
    faults = [
        file.fault(
            location,
            f"{what} has no column {name!r}{did_you_mean(name, names)}; it has {', '.join(names)}",
        )
        for name in wanted
        if name not in names
    ]
    if faults:
        raise FileFaults(faults)


def _even(stamps: Array) -> Array:
    """Return the even clock nearest to stamps, (n,) [s]."""
    counts = np.arange(len(stamps)) - (len(stamps) - 1) / 2
    return stamps.mean() + counts * float(counts @ stamps) / float(counts @ counts)


def _on(even: Array, stamps: Array, values: Array) -> Array:
    """Return values, (n, c), on an even clock: as they are where the stamps are that clock's.

    Stamps that were rounded when they were written are no uneven clock.
    """
    digits = next(
        (d for d in range(_DECIMALS) if np.allclose(stamps, stamps.round(d), 0, 1e-12)), _DECIMALS
    )
    allowed = max(_UNEVEN * (even[1] - even[0]), 10.0**-digits)
    if np.abs(stamps - even).max() <= allowed:
        return values
    moved = np.full_like(values, np.nan)
    nearest = _nearest(stamps, even)
    for c in range(values.shape[1]):
        known = np.isfinite(values[:, c])
        if np.count_nonzero(known) >= _LEAST:
            curve = scipy.interpolate.CubicSpline(stamps[known], values[known, c])
            moved[:, c] = np.where(known[nearest], curve(even), np.nan)
    return moved


def _nearest(stamps: Array, even: Array) -> NDArray[np.intp]:
    """Return the stamp nearest to each time, (n,)."""
    right = np.clip(np.searchsorted(stamps, even), 1, len(stamps) - 1)
    return np.where(even - stamps[right - 1] < stamps[right] - even, right - 1, right)


def _finer(inputs: Mapping[str, RigInput], times: Array, values: Array) -> tuple[Array, Array]:
    """Return inputs with points on their curves, where one of them goes by a curve."""
    if not any(one.between == "curve" for one in inputs.values()):
        return times, values
    at = np.arange((len(times) - 1) * _FINER + 1) / _FINER
    finer = np.interp(at, np.arange(len(times)), times)
    columns = []
    for column, one in zip(values.T, inputs.values(), strict=True):
        if one.between == "curve":
            columns.append(scipy.interpolate.CubicSpline(times, column)(finer))
        elif one.between == "held":
            columns.append(column[at.astype(np.int64)])
        else:
            columns.append(np.interp(finer, times, column))
    return finer, np.column_stack(columns)


def _faster(run: MeasuredRigRun, ratio: int) -> MeasuredRigRun:
    """Return a run with samples that are not seen between its own."""
    if ratio == 1:
        return run
    count = (len(run.times) - 1) * ratio + 1
    values = np.full((count, run.values.shape[1]), np.nan)
    values[::ratio] = run.values
    return replace(run, times=np.linspace(run.times[0], run.times[-1], count), values=values)
