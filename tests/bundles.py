"""Bundles of our own making, small but with every kind of file; and runs of the virtual bench."""

from __future__ import annotations

import json
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np

from workbench.bundle import (
    Asked,
    Bundle,
    Compared,
    Document,
    Measured,
    ObserverFacts,
    Series,
    SignalFacts,
    add_remark,
    events,
)
from workbench.report import write_views
from workbench.run import QuietOperator, carry_out, load_bench, read_experiment
from workbench.run.bench import BUILT_IN, VirtualBench
from workbench.timeseries import TimeSeries

NOW = datetime(2026, 3, 12, 10, 15).astimezone()

VALID = np.array([True, True, False, True])
TRACK = TimeSeries.of(
    np.arange(4) / 120 - 0.01,
    {"foot_x_m": [0.0, 1 / 3, 99.0, 0.1], "rotor_speed_rad_s": [1e-300, -2.5, 16.9, np.nan]},
    {"foot_x_m": VALID},
)
TWIN = TimeSeries.of(np.arange(3) / 200, {"foot_x_m": [0.0, 0.1, 0.2], "hinge_15_rad": [1, 2, 3]})
SUPPLY = TimeSeries.of([0.0, 0.2], {"set_voltage_V": [0.0, 4.52], "current_A": [0.0, 0.11]})
STATE = TimeSeries.of(
    np.arange(3) / 120, {"foot_x_m": [0.0, 0.1, 0.2], "missing_top_x_N": [0.0, 0.01, -0.02]}
)
DOCUMENTS: tuple[Document, ...] = ("protocol", "bench", "model", "shape", "calibration")
SERIES: dict[Series, TimeSeries] = {
    "track": TRACK, "raw": TRACK, "twin": TWIN, "supply": SUPPLY, "state": STATE,
}  # fmt: skip


def asked_for(**facts: Any) -> Asked:
    """What was asked for; `facts` change it."""
    return Asked.model_validate(
        {"kind": "run", "title": "Hop", "mode": "hop", "role": "train", "model": "thesis",
         "shape": "thesis-initial"} | facts
    )  # fmt: skip


def manifest_of(bundle: Bundle) -> dict[str, Any]:
    """The manifest by its keys on disk."""
    return _plain(bundle.manifest.flat())


def journal_of(bundle: Bundle) -> list[dict[str, Any]]:
    """The journal by its keys on disk, as far as it can be read."""
    return [_plain({"time_s": time} | event.as_json()) for time, event in bundle.record.events()]


def guardian_of(bundle: Bundle) -> list[dict[str, Any]]:
    """The log of the supply's guardian."""
    return bundle.record.guardian()


def _plain(facts: dict[str, Any]) -> dict[str, Any]:
    return json.loads(json.dumps(facts, default=str))


def note(bundle: Bundle, **facts: Any) -> None:
    """Add facts to the manifest, each to the section that it belongs to."""
    for kind in (Asked, Measured, Compared, ObserverFacts, SignalFacts):
        own = {key: value for key, value in facts.items() if key in kind.model_fields}
        if own:
            known = {k: v for k, v in manifest_of(bundle).items() if k in kind.model_fields}
            bundle.record.note(kind.model_validate(known | own))


def make_bundle(root: Path, name: str = "hop-16.99", now: datetime = NOW, **facts: Any) -> Bundle:
    """A finished run; `facts` change its manifest, `status` how it ended."""
    real = {"distance_m": 0.213, "hop_height_m": 0.018, "speed_rad_s": 16.9}
    every = {
        "title": "Hop at 17 rad/s", "operator": "Ada", "speed_rad_s": 16.988,
        "voltage_V": 4.52, "levels": None, "duration_s": 10.0, "real": real,
        "twin": real | {"distance_m": 0.248}, "error_mm": 16.9, "error_foot_mm": 7.7,
        "error_top_mm": 22.6, "warnings": [], "versions": {"workbench": "0.1.0"},
    } | facts  # fmt: skip
    status = every.pop("status", "complete")
    bundle = Bundle.create(root, name, now, asked_for())
    note(bundle, **every)
    for kind in DOCUMENTS:
        bundle.write_document(kind, f"name: {kind}\nangles: [0.1, 0.2]\n")
    bundle.write_resolved("protocol", {"title": "Hop", "steps": [{"run": {"speed": 17.0}}]})
    bundle.write_resolved("bench", {"name": "virtual"})
    bundle.record.journal(events.RunAsked(run=name), 0.0)
    bundle.record.journal(events.OutputOn(volts="4.52"), 2.0)
    bundle.record.wire('{"way": "sent", "bytes": "01 06"}')
    guarded = '{"event": "off", "confirmed": true}\n{"event": "terminals", "dead": true}\n'
    bundle.record.guardian_log.write_text(guarded, encoding="utf-8")
    bundle.write_take("take 1.csv", lambda path: _write(path, "Format Version,1.23\n1,2\n"))
    for kind, series in SERIES.items():
        bundle.series.write(kind, series, {"take": "abc"})
    if status != "unfinished":
        bundle.finish(status)
    bundle.write_view("recording", lambda path: _write(path, "RRF2 a recording"))
    bundle.write_view("report", lambda path: _write(path, "<html>the report</html>"))
    return bundle


def carried_out(
    folder: Path, steps: str, *, views: bool = False, **virtual: Any
) -> tuple[Bundle, ...]:
    """Carry steps out on the virtual bench.

    Args:
        folder: gets the protocol, `short.yaml`, and the bundles in `runs`.
        steps: of the protocol, in YAML.
        views: whether recording and report are drawn.
        virtual: what is different about the virtual bench.
    """
    path = folder / "short.yaml"
    head = "schema: workbench/protocol-1\ntitle: A short hop\nsteps:\n"
    path.write_text(head + steps, encoding="utf-8")
    bench = load_bench("virtual")
    assert bench.path == BUILT_IN
    assert bench.content.virtual is not None
    section = bench.content.virtual.model_copy(update=virtual)
    device = VirtualBench(bench.content.model_copy(update={"virtual": section}))
    asked = read_experiment(path, bench, device.voltage_step)
    done = tuple(carry_out(asked, device, folder / "runs", QuietOperator(), lambda text: None))
    for bundle in done if views else ():
        assert write_views(bundle) is None
    return done


def report_of(bundle: Bundle) -> str:
    """Draw the views of a run and return its report."""
    assert write_views(bundle) is None
    return bundle.view("report").read_text(encoding="utf-8")


def remarked(bundle: Bundle) -> Bundle:
    """The same with a tag, a note and a verdict."""
    add_remark(bundle.path, "tag", "paper", "Ada", NOW)
    add_remark(bundle.path, "note", "die Folie löst sich", "Grace", NOW)
    add_remark(bundle.path, "verdict", "good", "Ada", NOW)
    return bundle


def _write(path: Path, text: str) -> None:
    path.write_text(text, encoding="utf-8")
