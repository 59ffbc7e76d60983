"""Runs of the robot: opened, told in three lines, their series as tables."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from workbench.bundle import Asked, Bundle, Series, run_named, runs_named
from workbench.bundle.sentences import condition_words
from workbench.quantities import QUANTITIES, numbers_in_words

if TYPE_CHECKING:
    import pyarrow as pa

    from workbench.timeseries import TimeSeries

__all__ = ["Run", "Runs", "open_run", "open_runs"]

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

    def __repr__(self) -> str:
        """Return them in three lines: how they ended, what was asked, their names."""
        ended = Counter(run.status for run in self)
        asked = [run.bundle.manifest.asked for run in self]
        words = (" ".join(condition_words(one)) for one in asked if one is not None)
        return "\n".join(
            [f"{len(self)} run{'s' * (len(self) != 1)}: {_counted(ended)}",
             _counted(Counter(words)), _some([run.name for run in self])]
        )  # fmt: skip


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
            experiments; each stands for all runs that it means.
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


def _some(names: Iterable[str]) -> str:
    first, more = list(names)[:3], len(list(names)) - 3
    return ", ".join(first) + (f" and {more} more" if more > 0 else "")
