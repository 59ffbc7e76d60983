"""One rerun recording of a run beside its twin, or of several runs beside theirs.

`/real/**` and `/twin/**` hold the two robots, `/extended/**` a third one where a model was
extended, `/compared/base/**` and `/compared/extended/**` both models as a diagnosis compares them,
started and turned as was measured, in a tab of their own; `/plots/**` the curves, `/phase`,
`/log`, `/notes` and `/protocol` the story, all on the timeline `t` [s] whose zero is the rotor's
first motion or the release. Every entity is sent as whole columns, styles once.

Of several runs each has all that below `/runs/<number>/`, on the same timeline, so that all robots
start together; each run has a lane of its own. A tab shows one pair of robot and twin, the
first tab all of them, where the eye beside `/runs/<number>/real` or `twin` shows or hides a robot:
any two of them make a pair.

The recording is a view: it is made from a `Comparison` alone and can be made again.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import rerun as rr
import rerun.blueprint as rrb

from workbench.report import palette
from workbench.report.comparison import Comparison
from workbench.report.curves import plot_run
from workbench.report.lanes import draw_lanes, lanes
from workbench.report.layout import layout
from workbench.report.notes import overview
from workbench.report.scene import draw_floor, draw_real, draw_simulated
from workbench.report.texts import send_events

__all__ = ["APPLICATION", "write_recording", "write_together"]

APPLICATION = "hopping-workbench"


def write_recording(comparison: Comparison, path: Path) -> None:
    """Write the recording with its layout to `path`; the same comparison gives the same recording.

    Args:
        comparison: the run and its twin.
        path: the `.rrd` file; one that is there is replaced.
    """
    with _recording(comparison.run, comparison.headline, path, layout(comparison)) as stream:
        stream.send_property("run", rr.AnyValues(**_properties(comparison)))
        _send_run(stream, comparison, "")


def write_together(title: str, comparisons: Sequence[Comparison], path: Path) -> None:
    """Write several runs into one recording, each in a lane and under a tab of its own.

    Args:
        title: of the recording.
        comparisons: the runs, in the order of lanes and tabs.
        path: the `.rrd` file; one that is there is replaced.
    """
    ids = "+".join(comparison.run for comparison in comparisons)
    with _recording(ids, title, path, lanes(comparisons)) as stream:
        for number, comparison in enumerate(comparisons, start=1):
            root = f"runs/{number}/"
            values = rr.AnyValues(**_properties(comparison))
            stream.send_property(f"run_{number}", values)
            _send_run(stream, comparison, root)
        draw_lanes(stream, comparisons)
        table = rr.TextDocument(overview(title, comparisons), media_type="text/markdown")
        stream.log("notes", table, static=True)


@contextmanager
def _recording(
    identity: str, title: str, path: Path, blueprint: rrb.Blueprint
) -> Iterator[rr.RecordingStream]:
    # single rows are batched by a clock; sent at the end they stand at one place in every recording
    batched = rr.ChunkBatcherConfig.NEVER()
    stream = rr.RecordingStream(
        APPLICATION, recording_id=identity, send_properties=False, batcher_config=batched
    )
    stream.save(path, default_blueprint=blueprint)
    try:
        stream.send_recording_name(title)
        yield stream
    finally:
        stream.flush()
        stream.disconnect()  # writes the footer that makes the file complete


def _send_run(stream: rr.RecordingStream, comparison: Comparison, root: str) -> None:
    figure, extended = comparison.figure, comparison.extended
    draw_floor(stream, comparison, root)
    if len(comparison.real):
        draw_real(stream, f"{root}real", comparison.real, figure, comparison.estimate)
    if len(comparison.twin):
        draw_simulated(stream, f"{root}twin", comparison.twin, figure, palette.TWIN)
    if extended is not None:
        draw_simulated(stream, f"{root}extended", extended.motion, figure, palette.EXTENDED)
    if comparison.validation is not None:
        inks = {"base": palette.TWIN, "extended": palette.EXTENDED}
        for name, one in comparison.validation.both:
            draw_simulated(stream, f"{root}compared/{name}", one.motion, figure, inks[name])
    plot_run(stream, comparison, root)
    send_events(stream, comparison, root)


def _properties(comparison: Comparison) -> dict[str, Any]:
    """Return what the catalogue of a viewer shows of the run."""
    summaries = {"real": comparison.real_summary, "twin": comparison.twin_summary}
    extended = comparison.extended
    if extended is not None:
        summaries["extended"] = extended.summary
    numbers: dict[str, Any] = {
        f"{who}_{name}": value
        for who, summary in summaries.items()
        for name, value in summary.as_json().items()
    }
    if extended is not None:
        numbers |= {"extended_model": extended.model, "extended_misfit_mm": extended.misfit.both_mm}
    if comparison.validation is not None:
        numbers |= {f"compared_{name}_mm": one.rms_mm for name, one in comparison.validation.both}
    if comparison.mark is not None:
        numbers["mark"] = comparison.mark
    largest = comparison.largest_error()
    numbers |= {f"largest_error_{name}_mm": at.mm for name, at in largest.items()}
    return {
        "title": comparison.title,
        "run": comparison.run,
        "mode": comparison.mode,
        "time_zero": comparison.time_zero,
        "duration_s": comparison.duration_s,
        "misfit_mm": comparison.misfit.both_mm,
        "rerun_version": rr.__version__,
        **numbers,
    }
