"""A program's hold on the process that draws its live twins; rerun is loaded there alone."""

from __future__ import annotations

import json
import subprocess
import sys
from contextlib import suppress
from typing import Any, Self

from workbench.errors import WorkbenchError

__all__ = ["LiveViewer"]

_COMMAND = (sys.executable, "-m", "workbench.report.watching")
_END_S = 5.0


class LiveViewer:
    """Draws live twins until its `with` block ends; the window stays until it is closed.

    Args:
        viewer: port of a viewer that is open already; None opens a window.

    Attributes:
        port: on loopback, where shown states are sent.
        frames: how many were drawn.
        latency_ms: median, 99th percentile and greatest, from a frame's arrival until it was drawn;
            None before the end of the block, or where none was drawn.

    Raises:
        WorkbenchError: when there is no display for a window.
    """

    def __init__(self, viewer: str | None = None) -> None:
        options = () if viewer is None else ("--viewer", viewer)
        self._process = subprocess.Popen(
            [*_COMMAND, *options], stdin=subprocess.PIPE, stdout=subprocess.PIPE
        )
        said = self._received()
        if "port" not in said:
            self._process.wait()
            raise WorkbenchError(said.get("failed", "the live twin cannot be drawn"))
        self.port: int = said["port"]
        self.frames = 0
        self.latency_ms: tuple[float, float, float] | None = None

    def __enter__(self) -> Self:
        """Draw."""
        return self

    def __exit__(self, *_: object) -> None:
        """End the process, but not the window."""
        assert self._process.stdin is not None
        with suppress(OSError):
            self._process.stdin.close()
        said = self._received()
        if "shown" in said:
            self.frames, (p50, p99, most) = said["shown"], said["latency_ms"]
            self.latency_ms = p50, p99, most
        try:
            self._process.wait(_END_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        assert self._process.stdout is not None
        self._process.stdout.close()

    def _received(self) -> dict[str, Any]:
        assert self._process.stdout is not None
        with suppress(ValueError):
            return dict(json.loads(self._process.stdout.readline()))
        return {}
