"""Any mechanism of hinges and slides as a rig: an MJCF file, what was measured, possible causes."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import NDArray

from workbench.data_quality import Facts, Fault
from workbench.diagnose import RULES_OF_RIGS, Effects, Errors
from workbench.errors import FileFaults, InputError
from workbench.fit import (
    FIELDS,
    LIMITS,
    Channel,
    Edit,
    Free,
    Input,
    MjcfSystem,
    Parameter,
    Scope,
    System,
    compiled,
    explicit_inertias,
    require_hinges_and_slides,
)
from workbench.mechanism.accelerations import accelerometer, added_up
from workbench.mechanism.causes import candidates_of, rig_effects
from workbench.mechanism.errors import errors_in
from workbench.mechanism.files import found_in, write_extended
from workbench.mechanism.names import require_names
from workbench.mechanism.runs import (
    MeasuredRigRun,
    at_one_rate,
    noise_of,
    read_measured,
    repeats_of,
    run_of,
)
from workbench.schemas import Document, RigChannel, RigFile, load

__all__ = ["MechanismRig", "load_mechanism"]

_WHOLE = 3.0  # times the noise
_AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}


class MechanismRig:
    """A model, its runs and what may be other than it says; see `docs/reference/files.md`.

    A parameter is named after what it belongs to and its field, `pivot damping`; a candidate of the
    base parameters frees one of them and has no quantity of its own.

    Args:
        file: the rig file as read.

    Raises:
        FileFaults: with line and column, for what the model or the data do not have.
        InputError: for a model that cannot be compiled or data that cannot be used.
    """

    def __init__(self, file: Document[RigFile]) -> None:
        content = file.content
        self.name, self.file, self.rules = content.name, file, RULES_OF_RIGS
        self.spec = _spec(file)
        self.given, base = self._nominal()
        self.measured = tuple(
            read_measured(file, k, name) for k, name in enumerate(_run_names(content))
        )
        even = at_one_rate(self.measured)
        self.channels = _channels(file, self.measured, even[0].sample_s)
        felt = _accelerations(content)
        self.inputs = tuple(
            Input(name, one.actuator, "zero" if one.between == "held" else "first")
            for name, one in content.inputs.items()
        )
        self.runs = tuple(
            added_up(run_of(file, k, one, self.channels, self.given), felt)
            for k, one in enumerate(even)
        )
        more = {
            one.edit: Free(one.edit.key, one.edit.owner, one.tolerance, Scope.CANDIDATE)
            for one in rig_effects(content)
            if one.edit not in base
        }
        every = self._of(range(len(self.runs)), [*base.values(), *more.values()])
        made = {edit: parameter for parameter, edit in every.edits.items()}
        self._edits = {parameter.name: edit for parameter, edit in every.edits.items()}
        self.base = tuple(made[edit] for edit in base)
        self.candidates = candidates_of(
            content, {edit: made[edit] for edit in base}, {edit: made[edit] for edit in more}
        )

    @property
    def source(self) -> Path:
        """Return the rig file."""
        return self.file.path

    @property
    def names(self) -> tuple[str, ...]:
        """Return the names of the runs."""
        return tuple(run.name for run in self.runs)

    @property
    def roles(self) -> tuple[str, ...]:
        """Return the role of each run."""
        return tuple(run.role for run in self.file.content.runs)

    @property
    def facts(self) -> tuple[Facts, ...]:
        """Return what was measured of each run."""
        names = tuple(one.name for one in self.channels)
        return tuple(
            Facts(one.name, run.mode, run.role, names, one.values[one.begun])
            for one, run in zip(self.measured, self.file.content.runs, strict=True)
        )

    @property
    def whole(self) -> float:
        """Return how far off a free simulation may be; of `Rig`."""
        return _WHOLE

    def faults(self) -> Sequence[Fault]:
        """Return nothing: what a mechanism that nobody knows should do, only a fit shows."""
        return ()

    def repeats(self) -> float:
        """Return how often samples of noise repeat one another at rest; of `Rig`."""
        white = {c: one.sigma or 0.0 for c, one in enumerate(self.channels) if not one.memory}
        return repeats_of(self.measured, white)

    @property
    def files(self) -> dict[str, Path]:
        """Return what the rig file names: the MJCF file and the tables of each run."""
        folder, content = self.file.path.parent, self.file.content
        found = {"MJCF": folder / content.model}
        for name, run in zip(self.names, content.runs, strict=True):
            found[name] = folder / run.data
            if run.inputs is not None:
                found[f"inputs of {name}"] = folder / run.inputs
        return found

    def system(
        self, runs: Sequence[int], parameters: Sequence[Parameter], like: System | None = None
    ) -> MjcfSystem:
        """Return some runs as a system; of `Rig`.

        Args:
            runs: their numbers.
            parameters: that are fitted, known by their names; deviation, scope and kind of
                prior are those given. Others are nominal.
            like: is not needed, as inputs are measured.
        """
        return self._of(
            runs,
            [
                Free(edit.key, edit.owner, one.deviation, one.scope, one.flat, one.released)
                for one in parameters
                for edit in [self._edits[one.name]]
            ],
        )

    def finer(self) -> None:
        """Return None: its bodies are those of the file; of `Rig`."""

    def extend(
        self, path: Path, values: Mapping[str, float], effects: Effects, diagnosis: str = ""
    ) -> MechanismRig:
        """Write the rig with refitted numbers and what was found, and return it as read back.

        Args:
            path: of the new file, with or without `.yaml`.
            values: of base parameters as refitted beside the effects, by name.
            effects: candidate -> quantity -> value and standard error; a candidate that frees base
                parameters has none, and its value is among theirs.
            diagnosis: name of what it came from; that of the file if empty.

        Raises:
            InputError: when the file exists.
        """
        target = path if path.suffix == ".yaml" else path.with_name(f"{path.name}.yaml")
        names = [one.name for one in self.base]
        write_extended(target, self.file, names, values, effects, diagnosis or target.stem)
        return load_mechanism(target)

    def errors(
        self,
        runs: Sequence[int],
        values: Mapping[str, float] | None,
        angles: Sequence[NDArray[np.float64] | None] | None,
        threads: int = 0,
    ) -> Errors | None:
        """Return how far some runs are from what the model predicts; of `Rig`.

        Args:
            runs: their numbers.
            values: of the model's own numbers, where they are not those of its file.
            angles: (n,) of each run, not used: a mechanism has inputs [rad].
            threads: 0 takes all cores.
        """
        if not runs:
            return None
        plain = self._of(runs, (), {})
        return errors_in(self.system(runs, self.base), plain, values or {}, threads)

    def _of(
        self, runs: Sequence[int], free: Sequence[Free], given: Mapping[Edit, float] | None = None
    ) -> MjcfSystem:
        return MjcfSystem(
            self.spec, self.channels, [self.runs[k] for k in runs], self.inputs, free,
            given=self.given if given is None else given,
        )  # fmt: skip

    def _nominal(self) -> tuple[dict[Edit, float], dict[Edit, Free]]:
        """Return what is other than the MJCF file says, and what is refitted, by its edit."""
        content, given, base = self.file.content, {}, {}
        for k, one in enumerate(content.parameters):
            edit = Edit(one.field, one.owner)
            if edit in base:
                words = f"{one.field} of {one.owner} is a parameter twice; take one out"
                raise FileFaults([self.file.fault(("parameters", k), words)])
            base[edit] = Free(one.field, one.owner, one.tolerance / LIMITS)
            if one.value is not None:
                given[edit] = one.value
        for one, value, added in found_in(self.file, list(rig_effects(content))):
            before = 0.0
            if added and not one.edit.shared:
                before = FIELDS[one.edit.key].read(self.spec, one.edit.owner)
                before = given.get(one.edit, before)
            given[one.edit] = before + value
        return given, base


def load_mechanism(path: Path) -> MechanismRig:
    """Read a rig file, its model and its data.

    Raises:
        InputError: when one of them cannot be read or used.
        FileFaults: with all faults of the rig file.
    """
    return MechanismRig(load(path, RigFile))


def _spec(file: Document[RigFile]) -> mujoco.MjSpec:
    """Return the model of a rig file, whose names it has; bodies state their inertias."""
    path = file.path.parent / file.content.model
    if not path.is_file():
        raise FileFaults([file.fault(("model",), f"model: {path} is no file")])
    try:
        spec = mujoco.MjSpec.from_file(str(path))
        model = compiled(spec)
    except (ValueError, InputError) as error:
        said = str(error).rpartition("MuJoCo refuses it: ")[2]
        raise InputError(f"{path}: MuJoCo refuses it: {said}") from None
    try:
        require_hinges_and_slides(model)
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    require_names(file, model)
    return explicit_inertias(spec)[0]


def _accelerations(content: RigFile) -> dict[int, str]:
    """Return the channels that are accelerations, by their numbers -> their joints."""
    return {
        c: one.joint
        for c, one in enumerate(content.channels.values())
        if one.quantity == "acceleration" and one.joint is not None
    }


def _channels(
    file: Document[RigFile], measured: Sequence[MeasuredRigRun], sample_s: float
) -> tuple[Channel, ...]:
    """Return the channels with their noise, as stated or as the training runs show it."""
    content = file.content
    train = [
        one for one, run in zip(measured, content.runs, strict=True) if run.role == "train"
    ] or measured
    stated = {name: one.noise for name, one in content.channels.items()}
    noise = noise_of(stated, train)
    faults = [
        file.fault(
            ("channels", name),
            f"{name}: its noise cannot be found from the data; state `noise` (a resolution divided "
            "by sqrt(12) where steps are all that shows)",
        )
        for name, sigma in zip(stated, noise, strict=True)
        if sigma is None
    ]
    if faults:
        raise FileFaults(faults)
    return tuple(
        _channel(name, one, sigma, sample_s)
        for (name, one), sigma in zip(content.channels.items(), noise, strict=True)
    )


def _channel(name: str, given: RigChannel, sigma: float | None, sample_s: float) -> Channel:
    if given.joint is None:
        axis = _AXES[str(given.axis)]
        return Channel(name, "site", str(given.site), axis=axis, sigma=sigma)
    if given.quantity == "acceleration":
        return accelerometer(name, given.joint, sigma or 0.0, sample_s)
    of = "position" if given.quantity == "position" else "speed"
    return Channel(name, of, given.joint, sigma=sigma)


def _run_names(content: RigFile) -> list[str]:
    """Return a name for each run that no other has."""
    names = [run.name or Path(run.data).stem for run in content.runs]
    often, seen = Counter(names), Counter[str]()
    found = []
    for name in names:
        seen[name] += 1
        found.append(name if often[name] == 1 else f"{name} ({seen[name]})")
    return found
