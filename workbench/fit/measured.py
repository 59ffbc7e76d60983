"""What a fit sees of runs: the raw samples of their channels, their noise, and what was asked.

Which robot made them is found here, too: a fit of two robots at once is of neither.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import get_args

import numpy as np
from numpy.typing import NDArray

from workbench.bundle import Bundle, ReleaseFacts, sha256
from workbench.errors import InputError, require_named
from workbench.modes import Role
from workbench.motion import DRIVEN, FOOT, PITCH, ROTOR_ANGLE, TOP, Mode
from workbench.noise import robust_sigma, white_noise
from workbench.progress import Progress, counted
from workbench.schemas import Document, ModelFile, ShapeFile, load
from workbench.sim import SAMPLE_RATE_HZ
from workbench.timeseries import TimeSeries

__all__ = ["PLACES", "MeasuredRun", "measured_run", "measured_runs", "paced", "same_robot"]

PLACES: dict[Mode, tuple[str, ...]] = {
    "clamped": (TOP[0], TOP[2]),
    "decay": (TOP[0], TOP[2]),
    "drop": (FOOT[0], FOOT[2], TOP[0], TOP[2]),
    "hop": (FOOT[0], FOOT[2], TOP[0], TOP[2]),
}
"""Mode -> the places that its fit compares; a clamped foot does not move."""

_NONE_COMPLETE = (
    "none of these runs is complete, and only a complete run can be fitted; `workbench runs list` "
    "shows which are"
)
_LEAST_NOISE_M = 2e-5  # what cameras resolve at best; a noise of zero would blow up weights
_LEAST_NOISE_RAD = 5e-4
_LEAST_REST = 30  # samples at rest that show noise
_MEMORY = 1.4  # times what differences show: beyond chance
_LEAST_S = 0.5
_PACE = 0.01  # by how much the cameras' rate may differ from the observer's


@dataclass(frozen=True, eq=False)
class MeasuredRun:
    """One run as a fit sees it.

    Args:
        name: of the run, for messages.
        mode: what the robot did.
        motion: channels of `workbench.motion`, unfiltered; time zero is the first motion.
        steps: (time [s], commanded rotor speed [rad/s]); empty where nothing was driven.
        start_angle: of the rotor at rest [rad].
        pull: force on T before the release, in mode decay [N].
        height: of the fall, in mode drop [m].
        role: whether a fit may see it.

    Raises:
        InputError: when there is no such mode or role.
    """

    name: str
    mode: Mode
    motion: TimeSeries
    steps: tuple[tuple[float, float], ...] = ()
    start_angle: float = np.pi / 2
    pull: float = 0.0
    height: float = 0.0
    role: Role = "train"

    def __post_init__(self) -> None:
        """Refuse a mode or role that would be taken for another one."""
        require_named("mode", self.mode, get_args(Mode))
        require_named("role", self.role, get_args(Role))

    @property
    def driven(self) -> bool:
        """Return whether the motor ran."""
        return self.mode in DRIVEN

    @property
    def places(self) -> tuple[str, ...]:
        """Return the names of the places that are compared."""
        return PLACES[self.mode]

    @property
    def channels(self) -> tuple[str, ...]:
        """Return all channels that are compared: the places, and the angle of a driven rotor."""
        return (*self.places, ROTOR_ANGLE) if self.driven else self.places

    def at_rest(self) -> NDArray[np.float64]:
        """Return the median place before time zero, (p,) [m], NaN where it was not seen."""
        rest = self.motion.between(-np.inf, 0.0).select(self.places)
        seen = np.where(rest.valid, rest.values, np.nan)
        return np.array(
            [np.median(c[np.isfinite(c)]) if np.isfinite(c).any() else np.nan for c in seen.T]
        )

    def noise(self, channels: Sequence[str] = ()) -> NDArray[np.float64]:
        """Return the standard deviation of white noise in each channel, (c,) [m] or [rad].

        Args:
            channels: names; those that are compared where left out.

        From third differences, which no motion of the robot survives at 120 Hz. Noise with a memory
        hides from them; where the channel scatters clearly more at rest, that is taken.
        """
        chosen = self.motion.select(channels or self.channels)
        still = chosen.times < 0
        found = []
        for k, name in enumerate(chosen.names):
            seen = np.where(chosen.valid[:, k], chosen.values[:, k], np.nan)
            sigma = white_noise(seen, (3,), least=1)
            rest = seen[still & np.isfinite(seen)]
            if len(rest) >= _LEAST_REST:
                scatter = float(robust_sigma(rest, centred=True))
                sigma = scatter if scatter > _MEMORY * sigma else sigma
            floor = _LEAST_NOISE_RAD if name in (ROTOR_ANGLE, PITCH) else _LEAST_NOISE_M
            found.append(max(sigma, floor) if np.isfinite(sigma) else floor)
        return np.array(found)


def measured_run(bundle: Bundle) -> MeasuredRun:
    """Return what a fit sees of a bundle: its raw samples up to the end of what was asked.

    Raises:
        InputError: when the run did not succeed, so that nobody knows what its data mean.
    """
    manifest, compared = bundle.manifest, bundle.manifest.compared
    if (
        manifest.status != "complete"
        or compared is None
        or compared.command is None
        or compared.track is None
    ):
        raise InputError(
            f"{bundle.path}: status {manifest.status}; only a complete run can be fitted. "
            "`workbench runs list` shows which are"
        )
    release, command = compared.release or ReleaseFacts(), compared.command
    return MeasuredRun(
        name=manifest.id,
        mode=bundle.asked.mode,
        motion=bundle.series.read("raw").between(-np.inf, command.duration_s),
        steps=command.steps,
        start_angle=compared.track.start_angle_rad,
        pull=release.pull_N,
        height=release.height_m,
        role=bundle.asked.role,
    )


def measured_runs(bundles: Sequence[Bundle], progress: Progress) -> list[MeasuredRun]:
    """Return what a fit sees of bundles, in their order; one that is not complete is left out.

    Args:
        bundles: of the runs.
        progress: called at each run that is read, and each that is left out.

    Raises:
        InputError: when none is complete.
    """
    measured: list[MeasuredRun] = []
    for number, bundle in enumerate(bundles, start=1):
        status = bundle.manifest.status
        if status != "complete":
            progress(f"left out {bundle.path.name}: its status is {status}")
            continue
        progress(counted(f"read {bundle.path.name}", number, len(bundles)))
        measured.append(measured_run(bundle))
    if not measured:
        raise InputError(_NONE_COMPLETE)
    return measured


def same_robot(bundles: Sequence[Bundle]) -> tuple[Document[ModelFile], Document[ShapeFile]]:
    """Return the model and the shape that all complete bundles were made with.

    Raises:
        InputError: when they differ, or none is complete.
    """
    bundles = [bundle for bundle in bundles if bundle.manifest.status == "complete"]
    if not bundles:
        raise InputError(_NONE_COMPLETE)
    for kind in ("model", "shape"):
        seen: dict[str, str] = {}
        for bundle in bundles:
            seen.setdefault(sha256(bundle.document(kind)), bundle.path.name)
        if len(seen) > 1:
            raise InputError(
                f"the runs were made with different {kind} files: {', '.join(seen.values())}; "
                f"give only runs of one {kind}"
            )
    first = bundles[0]
    return load(first.document("model"), ModelFile), load(first.document("shape"), ShapeFile)


def paced(run: MeasuredRun) -> MeasuredRun:
    """Return a run at the observer's rate: every so many samples, missing ones not valid.

    Raises:
        InputError: when its own rate is no multiple of that, or it is too short.
    """
    name, motion, times = run.name, run.motion, run.motion.times
    if len(times) < 2 or times[-1] < _LEAST_S:
        raise InputError(f"{name}: less than {_LEAST_S:g} s were seen after the first motion")
    step = float(np.median(np.diff(times)))
    every = max(1, round(1 / (SAMPLE_RATE_HZ * step)))
    if abs(every * step * SAMPLE_RATE_HZ - 1) > _PACE:
        raise InputError(
            f"{name}: {1 / step:.0f} samples a second; the observer takes a multiple of "
            f"{SAMPLE_RATE_HZ}"
        )
    own, step = step, step * every
    grid = times[0] + step * np.arange(int((times[-1] - times[0] + own / 2) / step) + 1)
    nearest = np.clip(np.searchsorted(times, grid - own / 2), 0, len(times) - 1)
    there = np.abs(times[nearest] - grid) < own / 2
    valid = motion.valid[nearest] & there[:, None]
    return replace(run, motion=TimeSeries(grid, motion.values[nearest], motion.names, valid))
