"""The pages of all runs: the list's rows, runs beside each other, and trends of a condition."""

from __future__ import annotations

import json
from collections.abc import Sequence
from html import escape
from pathlib import Path
from urllib.parse import quote

import numpy as np

from workbench.bundle import Bundle, Series
from workbench.catalogue import Entry, Query, charted, condition_of, conditions, search, trends
from workbench.errors import InputError
from workbench.panel.charts import Curve, control_chart, curves_chart
from workbench.schemas import UNITS, identifications
from workbench.timeseries import TimeSeries

__all__ = ["MOST_COMPARED", "compare_page", "rows_json", "trend_page"]

MOST_COMPARED = 6
_FIELDS = (
    "name", "created", "title", "protocol", "mode", "fastest", "rotor", "distance", "twin_distance",
    "error", "noise", "status", "passed", "verdict", "tags", "operator", "model", "shape",
)  # fmt: skip
_CHANNELS = {
    "foot_x_m": "Foot forward", "foot_z_m": "Foot upward", "top_x_m": "T forward",
    "top_z_m": "T upward", "foot_pitch_rad": "Foot pitch", "rotor_speed_rad_s": "Rotor speed",
}  # fmt: skip
_SERIES: tuple[tuple[Series, str], ...] = (("track", "measured"), ("twin", "twin"))
_HEAD = """<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{title}</title><link rel="icon" href="icon.svg"><link rel="stylesheet" href="panel.css">
<link rel="stylesheet" href="runs.css"></head><body class="wide"><main>
<section class="runs"><p class="quiet"><a href="list">All runs</a></p>
<h1>{title}</h1>{lead}</section>
"""


def rows_json(root: Path) -> str:
    """Return the rows of all runs, newest first, as JSON: names of the fields, and values."""
    entries = search(root, Query(), _say_nothing).entries
    rows = [[getattr(entry, field) for field in _FIELDS] for entry in reversed(entries)]
    return json.dumps({"fields": _FIELDS, "rows": rows}, separators=(",", ":"), ensure_ascii=False)


def compare_page(root: Path, names: Sequence[str]) -> str:
    """Return the page of some runs beside each other: a table, and their curves overlaid.

    Raises:
        InputError: when one of them is no run of the folder, or they are too many.
    """
    found = {entry.name: entry for entry in search(root, Query(), _say_nothing).entries}
    wanted = list(dict.fromkeys(names))
    lost = [name for name in wanted if name not in found]
    if lost or not 0 < len(wanted) <= MOST_COMPARED:
        cause = f"no run {lost[0]!r}" if lost else f"choose 1 to {MOST_COMPARED} runs"
        raise InputError(f"runs to compare: {cause}")
    curves: dict[str, list[Curve]] = {channel: [] for channel in _CHANNELS}
    for number, name in enumerate(wanted):
        bundle, _ = Bundle.recover(root / name)
        for kind, style in _SERIES:
            if bundle.series.has(kind):
                _add_curves(curves, bundle.series.read(kind), f"curve run{number} {style}")
    charts = [
        curves_chart(title, "rad" if channel.endswith("rad") else "rad/s", some)
        if not channel.endswith("_m")
        else curves_chart(title, "mm", [c._replace(values=1e3 * c.values) for c in some])
        for (channel, title), some in zip(_CHANNELS.items(), curves.values(), strict=True)
    ]
    lead = '<p class="quiet">Solid: measured. Dashed: its twin. Time zero is the first motion.</p>'
    head = _HEAD.format(title=f"{len(wanted)} runs compared", lead=lead)
    table = _table([found[name] for name in wanted])
    return f'{head}{table}<section class="charts">{"".join(charts)}</section></main></body></html>'


def trend_page(root: Path, like: str = "", models: Path = Path("models")) -> str:
    """Return the page of control charts of one condition, and of what was identified over time.

    Args:
        root: folder of all bundles.
        like: name of a run of the condition; that with most runs if empty.
        models: folder that `workbench identify` writes to.

    Raises:
        InputError: when there is no such run.
    """
    entries = search(root, Query(), _say_nothing).entries
    every = conditions(entries)
    run = next((entry for entry in entries if entry.name == like), None)
    if like and run is None:
        raise InputError(f"trend: no run {like!r}")
    ranked = sorted(every, key=lambda one: -len(every[one]))
    wanted = condition_of(run) if run else next(iter(ranked), None)
    runs = [] if wanted is None else every.get(wanted, [])
    if wanted is None or not runs:
        lead = '<p class="quiet">No complete run of this condition can be charted.</p>'
        charts = ""
    else:
        lead = (
            f'<p class="quiet">{escape(str(wanted))}: {len(runs)} complete runs, those called bad '
            "left out. Limits: three standard deviations about the mean of the first 25 runs, from "
            "their moving ranges. A red dot is outside, or the eighth in a row on one side.</p>"
        )
        charts = "".join(map(control_chart, trends(runs)))
    others = "".join(
        f'<li><a href="trend?like={quote(every[one][-1].name)}">{escape(str(one))}</a> '
        f'<span class="quiet">{len(every[one])} run{"s" * (len(every[one]) != 1)}</span></li>'
        for one in ranked
        if one != wanted
    )
    rest = f'<section class="runs"><h2>Other conditions</h2><ul>{others}</ul></section>'
    head = _HEAD.format(title="Trend", lead=lead)
    section = f'<section class="charts">{charts}</section>' if charts else ""
    found = _identified(models)
    return f"{head}{section}{found}{rest if others else ''}</main></body></html>"


def _identified(models: Path) -> str:
    """Return the charts of each parameter that two identifications determined."""
    found = identifications(models)
    charts = [
        control_chart(trend)
        for name, unit in UNITS.items()
        for trend in charted(
            name.replace("_", " ").capitalize(),
            "" if unit == "1" else unit,
            {one.model: one.values[name] for one in found if name in one.values},
            "identification",
        )
    ]
    if not charts:
        return ""
    lead = (
        f'<section class="runs"><h2>Identified parameters</h2><p class="quiet">{len(found)} '
        f"identifications in {escape(models.name)}, {found[0].day} to {found[-1].day}; those that "
        "an identification did not determine are left out.</p></section>"
    )
    return f'{lead}<section class="charts">{"".join(charts)}</section>'


def _add_curves(curves: dict[str, list[Curve]], series: TimeSeries, style: str) -> None:
    for channel, some in curves.items():
        if channel in series:
            values = np.where(series.validity(channel), series[channel], np.nan)
            some.append(Curve(series.times, values, style))


def _table(entries: Sequence[Entry]) -> str:
    """Return what is known of each run, a column a run."""
    head = "".join(
        f'<th><span class="swatch run{k}"></span>{escape(entry.name)}</th>'
        for k, entry in enumerate(entries)
    )
    lines = []
    for title, field, form in (
        ("Title", "title", "{}"), ("Asked for [rad/s]", "fastest", "{:.2f}"),
        ("Measured [rad/s]", "rotor", "{:.2f}"), ("Distance [m]", "distance", "{:.3f}"),
        ("Twin's distance [m]", "twin_distance", "{:.3f}"), ("Error [mm]", "error", "{:.1f}"),
        ("Noise of T [mm]", "noise", "{:.3f}"), ("Status", "status", "{}"),
    ):  # fmt: skip
        values = [getattr(entry, field) for entry in entries]
        cells = "".join(
            f"<td>{'-' if value is None else escape(form.format(value))}</td>" for value in values
        )
        lines.append(f"<tr><th>{title}</th>{cells}</tr>")
    table = f"<table><thead><tr><th></th>{head}</tr></thead><tbody>{''.join(lines)}</tbody></table>"
    return f'<section class="runs"><div class="scroll beside">{table}</div></section>'


def _say_nothing(text: str) -> None:
    """Take the place of a terminal: what the index does not have is read from the bundles."""
