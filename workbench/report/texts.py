"""The words of a recording: phases, journal, notes, the protocol's own text."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import rerun as rr

from workbench.report import palette
from workbench.report.columns import TIMELINE
from workbench.report.comparison import Comparison
from workbench.report.notes import notes
from workbench.report.palette import rgb

__all__ = ["journal_lines", "send_events"]

_MARKDOWN = "text/markdown"


def send_events(stream: rr.RecordingStream, comparison: Comparison, root: str = "") -> None:
    """Send the words of a run below `root`, an entity path that ends in a slash or is empty."""
    if comparison.phases:
        names = [phase.name for phase in comparison.phases]
        times = [phase.time_s for phase in comparison.phases]
        _send_rows(stream, f"{root}phase", times, rr.StateChange.columns(state=names))
        stream.log(f"{root}phase", _phase_style(names), static=True)
    lines = journal_lines(comparison)
    if lines:
        times, levels, texts = zip(*lines, strict=True)
        _send_rows(stream, f"{root}log", times, rr.TextLog.columns(text=texts, level=levels))
    text = rr.TextDocument(notes(comparison), media_type=_MARKDOWN)
    stream.log(f"{root}notes", text, static=True)
    if comparison.protocol:
        fenced = rr.TextDocument(f"```yaml\n{comparison.protocol}\n```", media_type=_MARKDOWN)
        stream.log(f"{root}protocol", fenced, static=True)


def journal_lines(comparison: Comparison) -> list[tuple[float, str, str]]:
    """Return time, level and text of every line; mark and warnings are where the run begins."""
    begins = [float(motion.times[0]) for motion in comparison.motions if len(motion)]
    begins += [time for time, _ in comparison.log[:1]]
    start = min(begins, default=0.0)
    lines = [] if comparison.mark is None else [(start, "ERROR", comparison.mark)]
    lines += [(start, "WARN", text) for text in comparison.warnings]
    lines += [(time, "INFO", text) for time, text in comparison.log]
    # The viewer's own time column opens too narrow to be read, so the time is in the text.
    return [(time, level, f"{time:6.2f} s  {text}") for time, level, text in lines]


def _phase_style(names: list[str]) -> rr.StateConfiguration:
    distinct = list(dict.fromkeys(names))
    colors = [rgb(palette.PHASES[k % len(palette.PHASES)]) for k in range(len(distinct))]
    return rr.StateConfiguration(values=distinct, colors=colors)


def _send_rows(
    stream: rr.RecordingStream,
    path: str,
    times: Sequence[float],
    columns: Iterable[rr.ComponentColumn],
) -> None:
    stream.send_columns(path, [rr.TimeColumn(TIMELINE, duration=times)], columns)
