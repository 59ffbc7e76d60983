"""Runs of the robot: opened, described in three lines, their series as tables."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from workbench.bundle import Asked, Bundle, Series, condition_words, run_named, runs_named
from workbench.quantities import QUANTITIES, numbers_in_words

if TYPE_CHECKING:
    import pyarrow as pa

    from workbench.fit import Replay
    from workbench.investigate import Diagnosed
    from workbench.progress import Progress
    from workbench.report import Fitted
    from workbench.timeseries import TimeSeries
    from workbench.tracking import Take

__all__ = ["Run", "Runs", "open_run", "open_runs"]

_SHOWN = 3  # names that several runs print

RunWord = str | Path
"""A run as every verb of the command line takes it: path, name, number, or a part of the name."""


@dataclass(frozen=True, repr=False)
class Run:
    """One run: what was asked of the robot, what it did, and what its twin did.

    Args:
        bundle: the folder that holds it.

    Example:
        >>> run = wb.open_run("hop-16.99")
        >>> run.table("track").column("foot_x_m")
    """

    bundle: Bundle

    @property
    def name(self) -> str:
        """Name of the run's folder."""
        return self.bundle.path.name

    @property
    def status(self) -> str:
        """How it ended: `complete`, `failed`, `interrupted` or `safety-stop`."""
        return self.bundle.manifest.status

    @property
    def asked(self) -> Asked:
        """What was asked for: `mode`, `role`, `speed_rad_s`, `duration_s`, `model`, `shape`, ...

        Raises:
            InputError: when the manifest does not say.
        """
        return self.bundle.asked

    @property
    def summary(self) -> dict[str, Any]:
        """What robot (`real`) and `twin` did, and `error_mm` between them; units are in the names.

        Numbers that the run does not have are None: a run that was stopped has no twin.
        """
        from workbench.catalogue import describe

        return describe(self.bundle)

    @property
    def kinds(self) -> tuple[Series, ...]:
        """Which series the run has."""
        return self.bundle.series.kinds

    def series(self, kind: Series = "track") -> TimeSeries:
        """Return one series of the run; columns end in their unit, time is in s.

        Args:
            kind: `track`, the robot as the cameras saw it, cleaned; `raw`, neither filtered nor
                filled; `twin`, its simulation as commanded; `state`, the estimated pose and the
                missing force; `supply`, voltage and current, on the cameras' clock; `live`, the
                prediction error while the run went on.

        Raises:
            InputError: when the run has no such series; those that it has are named.

        Example:
            >>> run.series("supply")["current_A"].max()
        """
        return self.bundle.series.read(kind)

    def table(self, kind: Series = "track") -> pa.Table:
        """Return one series as an Arrow table, null where nothing was seen.

        Args:
            kind: as in `series`.

        Raises:
            InputError: as `series`.

        Example:
            >>> run.table("track").to_pandas().plot("time_s", "foot_x_m")
        """
        return self.series(kind).table()

    def take(self) -> Take:
        """Read the export of the cameras that the run was tracked from.

        Raises:
            InputError: when the run has none.

        Example:
            >>> wb.take_quality(run.take())["bodies"]["T"]["missing"]
        """
        from workbench.tracking import read_take

        return read_take(self.bundle.take())

    def twin(
        self,
        model: str | Path | None = None,
        parameters: Mapping[str, float] = MappingProxyType({}),
    ) -> Replay:
        """Simulate the run anew, started as it did and with the rotor turned as it was measured.

        What is off then is the model's, and not the motor's: `rms_mm`, over `error`, beside
        `noise_mm`. The twin as commanded is the series `twin`. A hop is compared up to its first
        hops, for then it is chaotic.

        Args:
            model: built-in name or path of a model file; the run's own where left out.
            parameters: values that replace the model's own, by name [SI].

        Raises:
            InputError: when the run is not complete or cannot be observed, or a name does not
                exist.

        Example:
            >>> run.twin().rms_mm, run.twin(parameters={"hinge_stiffness": 9.31}).rms_mm
        """
        from workbench.fit import compared, measured_run, paced, replayed
        from workbench.schemas import ModelFile, ShapeFile, load, load_model
        from workbench.twin import robot_of

        run, own = compared(paced(measured_run(self.bundle))), self.bundle.document("model")
        file = load(own, ModelFile) if model is None else load_model(str(model), Path())
        shape = load(self.bundle.document("shape"), ShapeFile).content
        return replayed(robot_of(file.content, shape, parameters), run)

    def __repr__(self) -> str:
        """Return it in a few lines: what it was, what came of it, what there is to look at."""
        asked, found = self.bundle.manifest.asked, self.summary
        what = "" if asked is None else f"{' '.join(condition_words(asked))}, {asked.role}, "
        lines = [f"Run {self.name}: {what}{self.status}"]
        lines += [
            f"{who}: {numbers_in_words(found[who])}" for who in ("real", "twin") if found[who]
        ]
        if found["error_mm"] is not None:
            lines[-1] += f"; error {found['error_mm']:.1f} mm rms"
        return "\n  ".join([*lines, f"series: {', '.join(self.kinds) or 'none'}"])


class Runs(tuple[Run, ...]):
    """Several runs, in order.

    Example:
        >>> clamped = wb.Runs(run for run in wb.open_runs() if run.asked.mode == "clamped")
    """

    __slots__ = ()

    def table(self) -> pa.Table:
        """Return a row for each run: what it was, and each number of robot and twin with its unit.

        Null where a run has no such number.

        Example:
            >>> wb.open_runs().table().to_pandas()
        """
        import pyarrow as pa

        rows = [_row(run) for run in self]
        names = dict.fromkeys(name for row in rows for name in row)
        return pa.table({name: [row.get(name) for row in rows] for name in names})

    def fit(
        self,
        parameters: str | Iterable[str] = (),
        out: str | Path | None = None,
        progress: Progress = lambda text: None,
    ) -> Fitted:
        """Fit parameters of the model to the runs with role `train`, as `workbench identify` does.

        Runs with role `held_out` validate what was fitted.

        Args:
            parameters: names in the model file; stiffness and damping of the beam where left out.
            out: new model file; by default `models/MODEL-DAY.yaml`. Its report lies beside it.
            progress: called with each stage, such as `print`.

        Returns:
            `found.estimates`, values with 90 % intervals in the unit of the model file,
            `found.within_tolerance`, those of the model's other numbers that moved, `validation`,
            the fitted `model` and its `report`.

        Raises:
            InputError: when `out` exists, the runs are of several robots, none is complete, or a
                parameter does not exist.

        Example:
            >>> wb.open_runs("runs/april").fit(["hinge_stiffness", "hinge_damping"])
        """
        from workbench.identify import BEAM
        from workbench.report import fit_runs

        target = None if out is None else Path(out)
        names = (parameters,) if isinstance(parameters, str) else tuple(parameters)
        return fit_runs([run.bundle for run in self], names or BEAM, target, progress)

    def diagnose(
        self,
        out: str | Path | None = None,
        look_ahead: bool = True,
        progress: Progress = lambda text: None,
    ) -> Diagnosed:
        """Find what the simulation gets wrong in the runs, as `workbench diagnose` does.

        Runs with role `train` are fitted, those `held_out` judge.

        Args:
            out: folder of model, answer and page; by default `diagnoses/TIME`.
            look_ahead: whether to look for the runs that would show more.
            progress: called with each stage, such as `print`.

        Returns:
            `found`, with `kind`, `reason`, `causes`, `refit` and `errors`, what is `proposed` to be
            run next, and the page, `report`.

        Raises:
            InputError: when the runs are of several robots, too few, or none is held out.
            DataFault: when so many runs are at fault that the others cannot be judged.

        Example:
            >>> wb.open_runs("runs/april").diagnose("diagnoses/april", progress=print)
        """
        from workbench.diagnose import robot_of
        from workbench.report import diagnose_into

        bundles = [run.bundle for run in self]
        target = None if out is None else Path(out)
        return diagnose_into(target, *robot_of(bundles, progress), bundles, progress, look_ahead)

    def __repr__(self) -> str:
        """Return them in three lines: how they ended, what was asked, their names."""
        ended = Counter(run.status for run in self)
        asked = [run.bundle.manifest.asked for run in self]
        words = (" ".join(condition_words(one)) for one in asked if one is not None)
        head = f"{len(self)} run{'s' * (len(self) != 1)}"
        if not self:
            return head
        names = _some([run.name for run in self])
        return f"{head}: {_counted(ended)}\n{_counted(Counter(words))}\n{names}"


def open_run(run: RunWord, folder: RunWord = "runs") -> Run:
    """Open one run.

    Args:
        run: path of its folder, or its name, a part of it or its number in `workbench runs list`.
        folder: of all runs.

    Raises:
        InputError: when no run is meant, or several are; they are named.

    Example:
        >>> run = wb.open_run("hop-16.99")
        >>> run
        Run 2026-03-12_101500_hop-16.99: hop at 16.99 rad/s, train, complete
    """
    return Run(Bundle.open(run_named(Path(run), Path(folder))))


def open_runs(*runs: RunWord, folder: RunWord = "runs") -> Runs:
    """Open several runs; all of a folder where none is named.

    Args:
        runs: paths, names, numbers or parts of names of runs, folders of runs, protocols and
            experiments; each means all of its runs.
        folder: of all runs.

    Raises:
        InputError: when a word means no run.

    Example:
        >>> wb.open_runs("runs/april").table().to_pandas()
    """
    words = [Path(word) for word in runs] or [Path(folder)]
    return Runs(Run(Bundle.open(path)) for path in runs_named(words, Path(folder)))


def _row(run: Run) -> dict[str, Any]:
    found, asked = run.summary, run.bundle.manifest.asked
    row = {"run": run.name, "status": run.status, "mode": found["mode"], "role": found["role"]}
    row["asked_speed_rad_s"] = None if asked is None else asked.speed_rad_s
    for who in ("real", "twin"):
        numbers = found[who] or {}
        row |= {f"{who}_{key}": numbers[key] for key in QUANTITIES if key in numbers}
    return row | {"error_mm": found["error_mm"]}


def _counted(found: Counter[str]) -> str:
    return ", ".join(f"{count} {name}" for name, count in found.items())


def _some(names: Sequence[str]) -> str:
    more = len(names) - _SHOWN
    return ", ".join(names[:_SHOWN]) + (f" and {more} more" if more > 0 else "")
