"""The observer: simulations that are corrected towards what was seen after every sample.

A job is one model on one run. Jobs of equal layout are taken together, some at a time on each
thread. Planar chains are stepped and corrected to the end of the run in one compiled call, without
the interpreter's lock, while the next jobs are made; of other models MuJoCo's batch steps from
sample to sample. Results do not depend on the number of threads, bit for bit.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import mujoco
import numpy as np
from mujoco.batch import Batch
from numpy.typing import NDArray

from workbench.fit.correction import correct, predicted, track_chains, translations
from workbench.fit.gain import Gain
from workbench.fit.observation import Observation
from workbench.sim import PlanarChain, Stepper, keep_engine_quiet, parallel_map

__all__ = ["Innovations", "Job", "SampleInnovations", "Start", "Together", "observe"]

Array = NDArray[np.float64]
_Numbers, _Which = NDArray[np.int64], NDArray[np.bool_]

_AT_ONCE = 8
_LED = 13  # times the steps of a sample: a lead of up to thirteen samples is in no longer steps
_STATE = int(mujoco.mjtState.mjSTATE_INTEGRATION)
_SLIDE, _HINGE = int(mujoco.mjtJoint.mjJNT_SLIDE), int(mujoco.mjtJoint.mjJNT_HINGE)
_CURRENT = int(mujoco.mjtStage.mjSTAGE_VEL)


@dataclass(frozen=True, eq=False)
class Start:
    """A model where a run starts, and what it is given.

    Args:
        model: compiled.
        state: (s,) mjSTATE_INTEGRATION at the start [SI].
        control: (n, nu) ctrl from each sample to the next [unit of the actuator].
        observation: of the run's channels.
        steps: of the engine from one sample to the next.
        lead: time from the start to the first sample [s].
        follow: entries of userdata that move with the first degree of freedom.
        chain: planar chain that is stepped in the model's place; None takes the model's own.
    """

    model: mujoco.MjModel
    state: Array
    control: Array
    observation: Observation
    steps: int
    lead: float = 0.0
    follow: tuple[int, ...] = ()
    chain: PlanarChain | None = None


@dataclass(frozen=True, eq=False, kw_only=True)
class Job(Start):
    """A start that is observed.

    Args:
        seen: (n, c) measured channels, NaN where not seen [unit of the channel].
        gain: of the correction.
        gate: (c,) innovation beyond which a sample is taken for a glitch and left out [unit of the
            channel]; None takes every sample.
    """

    seen: Array
    gain: Gain
    gate: Array | None = None

    @classmethod
    def of(cls, start: Start, seen: Array, gain: Gain, gate: Array | None = None) -> Job:
        """Return the job of the first samples of a start, as many as were measured.

        Args:
            start: of the run.
            seen: (n, c) measured channels, NaN where not seen [unit of the channel].
            gain: of the correction.
            gate: (c,) of `Job` [unit of the channel].
        """
        given: dict[str, Any] = vars(start) | {"control": start.control[: len(seen)]}
        return cls(**given, seen=seen, gain=gain, gate=gate)

    @property
    def gates(self) -> Array:
        """Return gate, infinite where every sample is taken, (c,) [unit of the channel]."""
        return np.full(self.seen.shape[1], np.inf) if self.gate is None else self.gate

    @property
    def layout(self) -> tuple[object, ...]:
        """Return what jobs must share to be stepped together."""
        model = self.model
        sizes = (model.nq, model.nv, model.nu, model.na, model.nbody, len(self.state))
        shapes = (self.seen.shape[1], self.gain.basis.shape[1], len(self.gain.covariance))
        return (*sizes, *shapes, tuple(self.observation.bodies), self.steps, self.follow)


@dataclass(frozen=True, eq=False)
class Innovations:
    """What a run shows that was not predicted.

    Args:
        error: (n, c) measured less predicted, NaN where not seen or left out [unit of the channel].
            Noise with a memory is predicted as well.
        white: (n, c) L^-1 error with L L' = S; zero where not seen [1].
        information: (n,) log det S [1].
        slopes: (n, c, m) derivative of the channels by the modes' coordinates [unit of the channel
            by m sqrt(kg)].
        rates: (n, c, m) the same by the coordinates' rates [unit of the channel by m sqrt(kg)/s].
        qpos: (n, nq) before each correction; empty unless kept [m, rad].
        qvel: (n, nv) the same [m/s, rad/s].
        sane: samples before the numbers blew up.
        qacc: (n, nv) in the step before, of which a chain's next step knows; empty unless kept
            [m/s^2, rad/s^2].
    """

    error: Array
    white: Array
    information: Array
    slopes: Array
    rates: Array
    qpos: Array
    qvel: Array
    sane: int
    qacc: Array = field(default_factory=lambda: np.zeros((0, 0)))


def observe(jobs: Iterable[Job], threads: int = 0, keep: bool = False) -> list[Innovations]:
    """Return the innovations of many jobs, in their order.

    Where jobs are made as they are asked for, the first are stepped while the next are made.

    Args:
        jobs: of any layouts.
        threads: 0 takes all cores.
        keep: whether the states before each correction are kept.
    """
    threads = threads or os.cpu_count() or 1
    done: dict[int, Innovations] = {}
    for found in parallel_map(lambda some: _observe(some, keep), _some(jobs, threads), threads):
        done |= found
    return [done[i] for i in range(len(done))]


def _some(jobs: Iterable[Job], threads: int) -> Iterator[dict[int, Job]]:
    """Yield some jobs of equal layout at a time, by their numbers, as soon as they are enough."""
    groups: dict[tuple[object, ...], list[tuple[int, Job]]] = {}
    for numbered in enumerate(jobs):
        group = groups.setdefault(numbered[1].layout, [])
        group.append(numbered)
        if len(group) == 2 * _AT_ONCE:  # the last are kept back, to be shared out evenly
            yield dict(group[:_AT_ONCE])
            del group[:_AT_ONCE]
    size = max(1, min(_AT_ONCE, -(-sum(map(len, groups.values())) // threads)))
    for group in groups.values():
        group.sort(key=lambda numbered: len(numbered[1].seen))
        yield from (dict(group[a : a + size]) for a in range(0, len(group), size))


def _observe(numbered: Mapping[int, Job], keep: bool) -> dict[int, Innovations]:
    """Observe jobs of equal layout on the calling thread."""
    jobs = list(numbered.values())
    together = Together(jobs)
    length = max(len(job.seen) for job in jobs)
    seen = _padded([job.seen for job in jobs], length, np.nan)
    control = _padded([job.control for job in jobs], length, 0.0)
    count, channels, modes = len(jobs), seen.shape[2], jobs[0].gain.basis.shape[1]
    found = SampleInnovations.of(length, count, channels, modes)
    qpos, qvel, qacc = (np.zeros((length if keep else 0, *part.shape)) for part in together.state)
    sane = together.track(control, seen, found, (qpos, qvel, qacc))
    rates = together.rates(found.slopes)
    return {
        number: Innovations(
            *(part[: len(job.seen), row] for part in found),
            rates=rates[: len(job.seen), row],
            qpos=qpos[: len(job.seen), row],
            qvel=qvel[: len(job.seen), row],
            sane=int(min(sane[row], len(job.seen))),
            qacc=qacc[: len(job.seen), row],
        )
        for row, (number, job) in enumerate(numbered.items())
    }


class SampleInnovations(NamedTuple):
    """What one sample, or many, (...), shows of s simulations; fields as those of `Innovations`.

    Args:
        error: (..., s, c) [unit of the channel].
        white: (..., s, c) [1].
        information: (..., s) [1].
        slopes: (..., s, c, m) [unit of the channel by m sqrt(kg)].
    """

    error: Array
    white: Array
    information: Array
    slopes: Array

    @classmethod
    def of(cls, *sizes: int) -> SampleInnovations:
        """Return room for (..., s, c, m), nothing seen."""
        error, white = np.full((2, *sizes[:-1]), np.nan)
        return cls(error, white, np.zeros(sizes[:-2]), np.zeros(sizes))


class Together:
    """Simulations of equal layout, from one sample to the next: of a track, or of a stream.

    Args:
        jobs: where each starts and how it is corrected; what was seen comes with each sample.
    """

    def __init__(self, jobs: Sequence[Job]) -> None:
        keep_engine_quiet()
        self.batch = batch = Batch(jobs[0].model, nsim=len(jobs), nthread=1, persistent=True)
        for row, job in enumerate(jobs):
            batch.state[row] = job.state
        models = [job.model for job in jobs]
        batch.set_models(models)
        batch.forward(stage=_CURRENT)
        chains = [job.chain for job in jobs]
        self._stepper = Stepper(batch, models, chains, places_alone=_has_own_jacobians(models[0]))
        self._stepper.lead(np.array([job.lead for job in jobs]), _LED * jobs[0].steps)
        self._steps, self._bodies = jobs[0].steps, jobs[0].observation.bodies
        self._view: Any = tuple(
            np.ascontiguousarray([getattr(job.observation, name) for job in jobs])
            for name in ("mix", "pick", "rates", "bias", "delays")
        )
        self._offsets = np.ascontiguousarray([job.observation.offsets for job in jobs])
        self._gain: Any = tuple(
            np.ascontiguousarray([getattr(job.gain, name) for job in jobs])
            for name in ("basis", "covariance", "noise", "memory")
        )
        self._coloured = np.zeros_like(self._gain[-1])
        self._follow = np.array(jobs[0].follow, dtype=np.int64)
        self.state: tuple[Array, Array, Array] = (
            batch.bind("qpos"), batch.bind("qvel"), batch.bind("qacc_warmstart"),
        )  # fmt: skip
        self._userdata, self._command = batch.bind("userdata"), batch.bind("ctrl")
        self._points = np.empty((len(jobs), len(self._bodies), 3))
        stepper = self._stepper
        self._placing = (stepper.xpos, stepper.xmat, self._bodies, self._offsets, self._points)
        self._jacobian = np.empty((len(jobs), 3 * len(self._bodies), jobs[0].model.nv))
        self._translating = _translating(batch, stepper.xanchor, self._bodies)
        self._gate = np.ascontiguousarray([job.gates for job in jobs])
        self._streak = np.zeros(self._gate.shape, dtype=np.int64)

    def track(
        self, control: Array, seen: Array, found: SampleInnovations, kept: tuple[Array, ...]
    ) -> NDArray[np.int64]:
        """Step from the first sample to the last and correct by each.

        Args:
            control: (s, n, nu) from each sample to the next [unit of the actuator].
            seen: (s, n, c) measured, NaN where not seen [unit of the channel].
            found: of (n, s) written.
            kept: of `state` before each correction, (n, s, nq) and twice (n, s, nv), written; of no
                samples where they are not wanted.

        Returns:
            Samples before the numbers of each simulation blew up, (s,).
        """
        sane = np.full(seen.shape[0], seen.shape[1])
        chains = self._stepper.chains(self._steps)
        if chains is not None and self._translating is not None:
            view = (*self._view, *self._gain, self._coloured, self._follow)
            track_chains(
                chains, self._command, control, seen, sane, self._stepper.broken, self._placing,
                (*self._translating, self._jacobian), (self._gate, self._streak), view,
                (*self.state, self._userdata), tuple(found), kept,
            )  # fmt: skip
            return sane
        for k in range(seen.shape[1]):
            if k:
                broken = self.step(control[:, k - 1])
                sane[broken] = np.minimum(sane[broken], k)
            if len(kept[0]):
                for part, now in zip(kept, self.state, strict=True):
                    part[k] = now
            self.correct(seen[:, k], SampleInnovations(*(part[k] for part in found)))
        return sane

    def step(
        self, control: Array, samples: int = 1, rows: NDArray[np.int32] | None = None
    ) -> NDArray[np.bool_]:
        """Step to the next sample and say which simulations blew up, (s,).

        Args:
            control: (s, nu) until then [unit of the actuator].
            samples: to step over.
            rows: (k,) which of them; all where left out.
        """
        self._command[:] = control
        self._stepper.broken[:] = False  # corrected, it may go on
        self._stepper.step(samples * self._steps, rows)
        return self._stepper.broken

    def correct(self, seen: Array, found: SampleInnovations) -> None:
        """Correct all simulations by one sample.

        Args:
            seen: (s, c) measured, NaN where not seen [unit of the channel].
            found: written.
        """
        predicted(*self._placing)
        if self._translating is not None:
            translations(self._points, *self._translating, self._jacobian)
        else:
            for p, body in enumerate(self._bodies):
                jacobian = self.batch.jac(int(body), self._points[:, p])[0]
                self._jacobian[:, 3 * p : 3 * p + 3] = jacobian
        row: Any = (
            seen, self._gate, self._streak, self._points, self._jacobian, *self._view, *self._gain,
            self._coloured, self._follow, *self.state[:2], self._userdata, *found,
        )  # fmt: skip
        correct(*row)

    def rates(self, slopes: Array) -> Array:
        """Return `Innovations.rates`, (..., s, c, m) [unit of the channel by m sqrt(kg)/s].

        Args:
            slopes: (..., s, c, m) of `Innovations` [unit of the channel by m sqrt(kg)].
        """
        pick_rate, delay, basis = self._view[2], self._view[4], self._gain[0]
        return pick_rate @ basis - delay[..., None] * slopes


def _has_own_jacobians(model: mujoco.MjModel) -> bool:
    """Return whether `translations` knows all its joints: they slide or are hinges."""
    return bool(np.isin(model.jnt_type, [_SLIDE, _HINGE]).all())


def _translating(
    batch: Batch, anchors: Array, bodies: NDArray[np.int64]
) -> tuple[_Numbers, Array, Array, _Numbers, _Which, _Which] | None:
    """Return what `translations` takes, but for points and Jacobian; None for other joints.

    The engine's own call does it for any joint, and costs a third of the whole observation; with
    `anchors`, xanchor (s, njnt, 3), hinges and slides are done here.
    """
    model = batch.model
    if not _has_own_jacobians(model):
        return None
    joints = model.dof_jntid.astype(np.int64)
    slides = model.jnt_type[joints] == _SLIDE
    moving = np.zeros((model.nbody, model.nv), dtype=np.bool_)
    for body in range(1, model.nbody):
        moving[body] = moving[model.body_parentid[body]] | (model.dof_bodyid == body)
    return bodies, anchors, batch.bind("xaxis"), joints, slides, moving


def _padded(parts: Sequence[Array], length: int, value: float) -> Array:
    """Stack rows of different lengths, (s, length, ...)."""
    full = np.full((len(parts), length, parts[0].shape[1]), value)
    for row, part in enumerate(parts):
        full[row, : len(part)] = part
    return full
