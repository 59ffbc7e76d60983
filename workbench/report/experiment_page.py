"""One page for all runs of a protocol: numbers with intervals, paths, every run with its link."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from markupsafe import Markup

from workbench.quantities import QUANTITIES, DisplayedQuantity
from workbench.report.comparison import Comparison
from workbench.report.notes import labels
from workbench.report.page import code, figure, picture, table, warning_list, write_page
from workbench.report.repeats import CONFIDENCE, MeanInterval, RepeatedRuns, conditions
from workbench.report.together_plots import bars, paths, thumbnail

__all__ = ["ExperimentPage", "write_experiment_page"]


_QUANTITIES = QUANTITIES | {"distance_m": DisplayedQuantity("Distance", "mm", 1e3, 1)}
"""Several runs differ by millimetres."""


@dataclass(frozen=True)
class ExperimentPage:
    """What a page of an experiment is made from.

    Args:
        title: of the protocol.
        about: which experiment it is.
        runs: in the order of the experiment.
        reports: of each run, the link to its report; empty where it has none.
        command: that opens the recording of all runs.
        picture: JPEG of that recording in the viewer, None where none could be taken.
    """

    title: str
    about: str
    runs: tuple[Comparison, ...]
    reports: tuple[str, ...]
    command: str
    picture: bytes | None = None


def write_experiment_page(page: ExperimentPage, path: Path) -> None:
    """Write the page to `path`; the same runs give the same bytes.

    Args:
        page: what it contains.
        path: the `.html` file; one that is there is replaced.
    """
    grouped = conditions(page.runs)
    sections = [
        ("Warnings", warning_list(_warnings(page.runs))),
        ("Results", _results(grouped)),
        ("Paths", _paths(grouped)),
        ("Runs", _runs(page)),
        ("Recording", _recording(page)),
        ("Protocol", _protocol(page.runs)),
    ]
    write_page(path, page.title, page.about, _verdict(page.runs, grouped), sections)


def _verdict(runs: Sequence[Comparison], grouped: Sequence[RepeatedRuns]) -> str:
    whole = [run for run in runs if run.mark is None]
    text = f"{_counted(len(runs), 'run')} of {_counted(len(grouped), 'condition')}"
    if len(whole) < len(runs):
        text += f", {len(runs) - len(whole)} of them not whole and left out of the numbers"
    errors = [run.misfit.both_mm for run in whole if math.isfinite(run.misfit.both_mm)]
    if errors:
        text += f". Robot and twin were {min(errors):.1f} to {max(errors):.1f} mm apart"
        text += " (root mean square of foot and T)"
    return f"{text}."


def _warnings(runs: Sequence[Comparison]) -> list[str]:
    """Return marks and warnings, each with the runs that it is about."""
    by_text: dict[str, list[int]] = {}
    for number, run in enumerate(runs, start=1):
        for text in (*([run.mark] if run.mark else ()), *run.warnings):
            by_text.setdefault(text, []).append(number)
    return [
        f"{'Runs' if len(found) > 1 else 'Run'} {', '.join(map(str, found))}: {text}"
        for text, found in by_text.items()
    ]


def _results(grouped: Sequence[RepeatedRuns]) -> Markup:
    """Return mean and interval of every number of robot and twin, and the figure of the first."""
    names = dict.fromkeys(
        name for one in grouped for run in one.runs for name in run.real_summary.as_json()
    )
    kept = [name for name in QUANTITIES if name in names]
    rows = [
        (condition.name if name == kept[0] else "", _named(name), *_compared(condition, name))
        for condition in grouped
        for name in kept
    ]
    heads = ("Condition", "Quantity", "Runs", "Real", "Twin", "Twin - real")
    percent = f"{100 * CONFIDENCE:.0f} %"
    about = f"Bars: mean of the repeats; whiskers: its {percent} interval; points: the runs."
    return table(rows, heads, css="numbers spreads") + figure(
        bars(grouped, kept[0], _QUANTITIES[kept[0]]), about
    )


def _compared(condition: RepeatedRuns, name: str) -> tuple[str, str, str, str]:
    """Return how many runs count, then robot, twin and their difference, each with its interval."""
    quantity = _QUANTITIES[name]

    def si(who: str, run: Comparison) -> float:
        summary = run.real_summary if who == "real" else run.twin_summary
        return summary.as_json().get(name, math.nan)

    real = condition.interval(lambda run: quantity.factor * si("real", run))
    twin = condition.interval(lambda run: quantity.factor * si("twin", run))
    apart = condition.interval(lambda run: quantity.apart(si("real", run), si("twin", run)))
    shown = _text(real, quantity), _text(twin, quantity), _text(apart, quantity, sign="+")
    return str(real.known), *shown


def _text(found: MeanInterval, quantity: DisplayedQuantity, sign: str = "") -> str:
    if not math.isfinite(found.mean):
        return "not measured"
    mean = f"{found.mean:{sign}.{quantity.digits}f}"
    half = f" \N{PLUS-MINUS SIGN} {found.half:.{quantity.digits}f}" if found.known > 1 else ""
    return mean + half


def _named(name: str) -> str:
    quantity = _QUANTITIES[name]
    return f"{quantity.name} [{quantity.unit}]" if quantity.unit else quantity.name


def _paths(grouped: Sequence[RepeatedRuns]) -> Markup:
    moving = [one for one in grouped if any(len(run.real) or len(run.twin) for run in one.runs)]
    if not moving:
        return Markup()
    return figure(
        paths(moving),
        "Path of the foot, or of T where the foot is clamped, all repeats in one panel; the height "
        "is stretched.",
    )


def _runs(page: ExperimentPage) -> Markup:
    """Return a row for each run: its number, picture, condition, numbers and report."""
    name = next(iter(page.runs[0].real_summary.as_json()))
    titles = labels(page.runs)
    rows = [
        (
            f"{number}",
            Markup(thumbnail(run)),
            titles[number - 1] or run.title,
            _number(run.real_summary.as_json(), name),
            _number(run.twin_summary.as_json(), name),
            f"{run.misfit.both_mm:.1f} mm" if math.isfinite(run.misfit.both_mm) else "-",
            _link(run, report),
        )
        for number, (run, report) in enumerate(zip(page.runs, page.reports, strict=True), start=1)
    ]
    quantity = QUANTITIES[name].name
    heads = ("Run", "", "Condition", f"{quantity}, real", "Twin", "Error", "Report")
    return table(rows, heads, css="runs")


def _number(summary: dict[str, float], name: str) -> str:
    quantity, value = _QUANTITIES[name], summary.get(name, math.nan)
    if not math.isfinite(value):
        return "-"
    return quantity.text(value)


def _link(run: Comparison, report: str) -> Markup:
    mark = Markup() if run.mark is None else Markup("<br><strong>{}</strong>").format(run.mark)
    name = run.run.split("_", 2)[-1]
    if not report:
        return Markup("{}").format(name) + mark
    return Markup('<a href="{}" title="{}">{}</a>').format(report, run.run, name) + mark


def _recording(page: ExperimentPage) -> Markup:
    drawn = picture(page.picture, "The recording of all runs in the viewer.")
    words = "<p>All robots start together, each pair in a lane and under a tab. Open it with</p>"
    return drawn + Markup(words) + code(page.command)


def _protocol(runs: Sequence[Comparison]) -> Markup:
    text = next((run.protocol for run in runs if run.protocol), "")
    return code(text.rstrip()) if text else Markup()


def _counted(count: int, noun: str) -> str:
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"
