"""Base and extended model as a diagnosis compared them with a run held out.

Page, recording and answer show the same numbers because they are made of the same motions: these
are kept beside the answer, `compared/RUN.base.parquet` and `compared/RUN.extended.parquet`, each
with its error over time.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from workbench.bundle import read_series, sha256, write_series
from workbench.diagnose import Diagnosis, Errors, read_answer, root_mean_square
from workbench.errors import InputError
from workbench.motion import FOOT_ERROR, TOP_ERROR
from workbench.report.comparison import Replayed, ValidationReplay
from workbench.timeseries import TimeSeries

__all__ = ["kept_replay", "replay_of", "write_compared"]

_FOLDER = "compared"
_BASE = "refitted"
_MEASURED = "Both models start as the robot did, and their rotors turn as it was seen to turn."
_DRIVEN = (
    "Both models start as the robot did. The cause is the drive's, so that their rotors turn as "
    "commanded: the base's by the calibrated line, the extended model's with the cause."
)


def replay_of(found: Diagnosis, run: str) -> ValidationReplay | None:
    """Return base and extended model beside a run held out; None of another rig, or another run."""
    base, extended = found.errors, found.extended_errors
    if base is None or extended is None or run not in base.motions or run not in extended.motions:
        return None
    assert found.extended is not None
    names = {"base": _BASE, "extended": Path(found.extended.source).stem}
    shown = {
        who: Replayed(names[who], one.motions[run], one.over_time[run], one.by_run[run],
                      one.predicted.get(run, {}))
        for who, one in (("base", base), ("extended", extended))
    }  # fmt: skip
    part = found.parts.get("drive")
    driven = bool(part and part.best.names)
    return _replay(shown, base.noise[run], found.extended.source.parent.name, driven)


def write_compared(folder: Path, found: Diagnosis) -> None:
    """Keep what both models did in the runs held out, in the folder of the diagnosis."""
    for who, errors in (("base", found.errors), ("extended", found.extended_errors)):
        for run, motion in {} if errors is None else errors.motions.items():
            (folder / _FOLDER).mkdir(exist_ok=True)
            write_series(_path(folder, run, who), _joined(motion, errors, run), {})


def kept_replay(model: Path, run: str, take: Path) -> ValidationReplay | None:
    """Return what the diagnosis that wrote a model compared with a run; None where it did not.

    Args:
        model: the extended one, in the folder of its diagnosis.
        run: name of its bundle.
        take: its export; a diagnosis of another one under that name does not count.
    """
    for file in sorted(model.parent.glob("*.json")):
        answer = read_answer(file)
        figures: dict[str, Any] = answer.get("errors_by_run", {}).get(run, {})
        if Path(answer.get("extended_model") or "").name != model.name or not figures:
            continue
        if answer.get("files", {}).get(run) != sha256(take):
            continue
        try:
            shown = {
                who: _parted(read_series(_path(model.parent, run, who)), name, figures[who])
                for who, name in (("base", _BASE), ("extended", model.stem))
            }
        except InputError:
            return None
        return _replay(shown, figures["noise_floor"], file.stem, bool(answer.get("drive_compared")))
    return None


def _replay(
    shown: Mapping[str, Replayed], noise: float, diagnosis: str, driven: bool
) -> ValidationReplay:
    until = float(shown["base"].error.times[-1])
    about = (
        f"{_DRIVEN if driven else _MEASURED} This run was held out of the diagnosis {diagnosis}."
    )
    return ValidationReplay(shown["base"], shown["extended"], noise, until, about)


def _joined(motion: TimeSeries, errors: Errors | None, run: str) -> TimeSeries:
    """Return a motion with its error, at the times of the motion."""
    assert errors is not None
    error = errors.over_time[run].between(float(motion.times[0]), float(motion.times[-1]))
    columns = {name: one[name] for one in (motion, error) for name in one.names}
    valid = {name: one.validity(name) for one in (motion, error) for name in one.names}
    return TimeSeries.of(motion.times, columns, valid)


def _parted(joined: TimeSeries, name: str, figures: Mapping[str, Any]) -> Replayed:
    error = joined.select([one for one in (FOOT_ERROR, TOP_ERROR) if one in joined])
    motion = joined.select([one for one in joined.names if one not in error])
    return Replayed(name, motion, error, root_mean_square(error), figures["ahead"])


def _path(folder: Path, run: str, who: str) -> Path:
    return folder / _FOLDER / f"{run}.{who}.parquet"
