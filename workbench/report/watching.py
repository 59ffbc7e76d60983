"""The process that draws a live twin in the viewer: `python -m workbench.report.watching`.

It opens the viewer, prints the port on which it takes shown states, a line of JSON each, and draws
the newest: whoever sends them waits for nothing here. At the end of its standard input it prints
how late they were drawn; the viewer stays until it is closed.
"""

from __future__ import annotations

import argparse
import json
import signal
import socket
import sys
import threading
import time
from typing import Any

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from workbench.errors import WorkbenchError
from workbench.loopback import HERE
from workbench.report import palette
from workbench.report.columns import TIMELINE
from workbench.report.layout import curves, scene
from workbench.report.palette import rgb
from workbench.report.recording import APPLICATION
from workbench.report.viewer import start_viewer

__all__ = ["LiveDrawing", "main"]

_FORCE_M_PER_N = 20.0  # length of an arrow of missing force at first: 5 mN are 0.1 m
_LONGEST_M = 0.2  # an arrow; the scale is halved until they are shorter
_THICKNESS_M = 0.008
_ROBOTS = {"robot": ("real", palette.REAL), "twin": ("sim", palette.TWIN)}


class LiveDrawing:
    """Draws states as they come.

    Args:
        stream: the recording.
        foot: length and width of the foot [m].
        limit_mm: prediction error on which the run stops; None where it does not.
    """

    def __init__(
        self, stream: rr.RecordingStream, foot: tuple[float, float], limit_mm: float | None
    ) -> None:
        self._stream, self._limit_mm = stream, limit_mm
        self._reach = dict.fromkeys(("top", "foot"), _FORCE_M_PER_N)
        self._half = [foot[0] / 2, foot[1] / 2, _THICKNESS_M / 2]
        styles = {"error": (palette.REAL, "prediction error"), "limit": ("#c2413c", "limit")}
        for name, (color, said) in styles.items():
            lines = rr.SeriesLines(colors=rgb(color), names=said)
            stream.log(f"plots/prediction_mm/{name}", lines, static=True)
        for point, color in (("top", palette.SHADES["top"]), ("foot", palette.SHADES["foot"])):
            lines = rr.SeriesLines(colors=rgb(color), names=point)
            stream.log(f"plots/missing_mN/{point}", lines, static=True)

    @staticmethod
    def layout() -> rrb.Blueprint:
        """Return the views: robot and twin, prediction error, missing force."""
        eye = rrb.EyeControls3D(
            kind="Orbital",
            position=(0.1, -0.9, 0.42),
            look_target=(0.02, 0.0, 0.12),
            eye_up=(0, 0, 1),
            tracking_entity="/real/foot",
        )
        window = rrb.VisibleTimeRange(
            TIMELINE,
            start=rrb.TimeRangeBoundary.cursor_relative(seconds=-10),
            end=rrb.TimeRangeBoundary.cursor_relative(),
        )
        error = curves("/plots/prediction_mm", "Prediction error, 0.1 s ahead [mm]")
        missing = curves("/plots/missing_mN", "Missing force [mN]")
        for view in (error, missing):
            view.properties["VisibleTimeRanges"] = rrb.VisibleTimeRanges(window)
        robots = ["/real/**", "/sim/**"]
        return rrb.Blueprint(
            rrb.Horizontal(
                scene("Robot (orange), twin (blue), missing force (violet)", "", robots, eye,
                      -_THICKNESS_M / 2),
                rrb.Vertical(error, missing),
                column_shares=[3, 2],
            ),
            rrb.TimePanel(timeline=TIMELINE, play_state="following", state="collapsed"),
            collapse_panels=True,
        )  # fmt: skip

    def draw(self, facts: dict[str, Any]) -> None:
        """Draw one state."""
        stream = self._stream
        stream.set_time(TIMELINE, duration=facts["time_s"])
        for who, (path, color) in _ROBOTS.items():
            self._draw_robot(path, facts[who], color)
        self._draw_forces(facts)
        if facts["error_mm"] is not None:
            stream.log("plots/prediction_mm/error", rr.Scalars(facts["error_mm"]))
        if self._limit_mm is not None:
            stream.log("plots/prediction_mm/limit", rr.Scalars(self._limit_mm))

    def _draw_robot(self, path: str, robot: dict[str, Any] | None, color: str) -> None:
        stream, ink = self._stream, rgb(color)
        if robot is None:
            stream.log(path, rr.Clear(recursive=True))
            return
        real = path == "real"
        foot = [] if robot["foot"] is None else [robot["foot"]]
        turn = rr.Quaternion(xyzw=[0, np.sin(robot["pitch"] / 2), 0, np.cos(robot["pitch"] / 2)])
        box = rr.Boxes3D(
            centers=foot,
            half_sizes=[self._half] * len(foot),
            quaternions=[turn] * len(foot),
            colors=ink,
            fill_mode="solid" if real else "majorwireframe",
        )
        stream.log(f"{path}/foot", box)
        ends = [robot[name] for name in ("top", "rotor") if robot[name] is not None]
        stream.log(
            f"{path}/ends", rr.Points3D(ends, radii=[0.008, 0.0104][: len(ends)], colors=ink)
        )
        strips = [robot["beam"], *([ends] if len(ends) == 2 else [])]
        stream.log(f"{path}/beam", rr.LineStrips3D(strips, radii=0.003, colors=ink))

    def _draw_forces(self, facts: dict[str, Any]) -> None:
        forces, ink = facts["missing"], rgb(palette.SHADES["missing"])
        if forces is None:
            return
        drawn = {point: force for point, force in forces.items() if facts["robot"][point]}
        for point, force in drawn.items():
            while self._reach[point] * np.linalg.norm(force) > _LONGEST_M:
                self._reach[point] /= 2
        arrows = rr.Arrows3D(
            origins=[facts["robot"][point] for point in drawn],
            vectors=[[self._reach[at] * part for part in force] for at, force in drawn.items()],
            colors=ink,
            radii=0.003,
        )
        top, foot = self._reach["top"], self._reach["foot"]
        scale = rr.AnyValues(top_metres_per_newton=top, foot_metres_per_newton=foot)
        self._stream.log("real/missing", arrows, scale)
        for point in ("top", "foot"):
            size = 1e3 * float(np.linalg.norm(forces.get(point, [0.0])))
            self._stream.log(f"plots/missing_mN/{point}", rr.Scalars(size))


class _Newest:
    """The newest line of a link; what was not taken in time is gone."""

    def __init__(self, link: socket.socket) -> None:
        self._link, self._news = link, threading.Condition()
        self._first: dict[str, Any] | None = None
        self._state: dict[str, Any] | None = None
        self._ended = False
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self) -> None:
        with self._link, self._link.makefile("rb") as lines:
            for text in lines:
                ((kind, value),) = json.loads(text).items()
                with self._news:
                    if kind == "observing":
                        self._first = value
                    else:
                        self._state = value
                    self._news.notify()
        with self._news:
            self._ended = True
            self._news.notify()

    def first(self) -> dict[str, Any] | None:
        """Return what is said before the first state; None when the link ends."""
        with self._news:
            self._news.wait_for(lambda: self._first is not None or self._ended)
            return self._first

    def take(self) -> dict[str, Any] | None:
        """Wait for a new state and return it; None when the link ends."""
        with self._news:
            self._news.wait_for(lambda: self._state is not None or self._ended)
            state, self._state = self._state, None
            return state


def main() -> None:
    """Draw what is sent until the standard input ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the run's
    parser = argparse.ArgumentParser()
    parser.add_argument("--viewer", help="port of a viewer that is open already")
    asked = parser.parse_args()
    listener = socket.create_server((HERE, 0))
    try:
        viewer = asked.viewer or start_viewer()
    except WorkbenchError as error:
        _say(failed=str(error))
        return
    _say(port=listener.getsockname()[1])
    late: list[float] = []
    threading.Thread(target=_accept, args=(listener, viewer, late), daemon=True).start()
    sys.stdin.buffer.read()
    if late:
        p50, p99 = np.percentile(late, [50, 99])
        _say(shown=len(late), latency_ms=[float(p50), float(p99), max(late)])


def _accept(listener: socket.socket, viewer: str, late: list[float]) -> None:
    """Draw run after run, each in a recording of its own."""
    while True:
        newest = _Newest(listener.accept()[0])
        first = newest.first()
        if first is None:
            continue
        stream = rr.RecordingStream(APPLICATION, send_properties=False)
        layout = LiveDrawing.layout()
        stream.connect_grpc(f"rerun+http://{HERE}:{viewer}/proxy", default_blueprint=layout)
        stream.send_recording_name(first["name"])
        drawing = LiveDrawing(stream, first["foot"], first["limit_mm"])
        while (state := newest.take()) is not None:
            drawing.draw(state)
            late.append(1e3 * (time.monotonic() - state["arrived_s"]))


def _say(**facts: Any) -> None:
    print(json.dumps(facts), flush=True)


if __name__ == "__main__":
    main()
