"""rerun's viewer, without a window for tests and pictures, with one for people.

This is the only place that touches `rerun.experimental`, whose names may move with a release.
The viewer listens on this computer only and runs with rerun's usage statistics switched off, for
this process alone: nobody's own settings are touched.
"""

from __future__ import annotations

import os
import re
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Self, TypeVar
from urllib.parse import quote

import rerun_cli
from rerun.experimental import LogEntry, ViewerClient, ViewerState

from workbench.errors import InputError, WorkbenchError
from workbench.progress import Progress

__all__ = ["HeadlessViewer", "open_viewer", "start_viewer", "viewer_version"]

_T = TypeVar("_T")

_LOCAL = "127.0.0.1"
_POLL_S = 0.1
_STARTING_S = 20.0
_LOADING_S = 60.0
_PAINTING_S = 10.0
_STOPPING_S = 5.0
_VERSION_S = 30.0
_DISPLAYS = ("DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET")
_OTHERWISE = (
    "`workbench review RUN --web` opens it in a browser, `--save FILE.rrd` writes it to be opened "
    "with rerun elsewhere"
)
_ANSWERS = (ConnectionError, RuntimeError)  # of a client whose viewer is not there (yet)


class HeadlessViewer:
    """A viewer without a window; use it in a `with` block, at whose end the process is gone.

    Args:
        width: of the window that would be [px].
        height: of the window that would be [px].

    Attributes:
        port: on loopback, where recordings can be sent.

    Raises:
        WorkbenchError: when the viewer does not start, for example without a Vulkan driver.
    """

    def __init__(self, width: int = 1600, height: int = 1000) -> None:
        """Note the size; the process starts with the block."""
        self._size = f"{width}x{height}"

    def __enter__(self) -> Self:
        """Start the process and wait until it has painted its first picture."""
        self.port = port = _free_port()
        self._output = tempfile.TemporaryFile()
        self._process = _start(
            ["--headless", "--hide-welcome-screen", "--window-size", self._size, "--port", port],
            self._output.fileno(),
        )
        try:
            self._client = self._wait_for_client(port)
        except BaseException:
            self.close()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        """Stop the process, whatever happened."""
        self.close()

    def open(self, path: Path, deadline_s: float = _LOADING_S) -> ViewerState:
        """Open a recording and wait until all of it is there.

        Raises:
            InputError: when there is no such recording.
            WorkbenchError: when it is not loaded within `deadline_s`, or the viewer ends over it.
        """
        self._client.open(str(_existing(path).resolve()))
        try:
            return _until(
                lambda: _loaded(self._client.get_state()),
                deadline_s,
                f"{path.name} was not loaded within {deadline_s:g} s",
            )
        except _ANSWERS as error:
            raise WorkbenchError(
                f"rerun's viewer ended while it opened {path.name}: {self._last_words()}"
            ) from error

    def set_time(self, seconds: float, timeline: str = "t") -> None:
        """Move the time cursor."""
        self._client.set_time(timeline, duration=seconds)

    def state(self) -> ViewerState:
        """Return what the viewer shows: views with their reports, timelines, what still loads."""
        return self._client.get_state()

    def screenshot(self, png: Path, view_id: str | None = None) -> None:
        """Save the whole window, or the one view, as a PNG, once it has stopped changing.

        A view goes on loading after the recording is there and lags behind the time cursor by a
        picture or two, without its state saying so.

        Raises:
            WorkbenchError: when it still changes after ten seconds.
        """
        before = b""

        def painted() -> bytes | None:
            nonlocal before
            last, before = before, self._client.take_screenshot(view_id)
            return before if before == last else None

        png.write_bytes(
            _until(painted, _PAINTING_S, f"the picture still changes after {_PAINTING_S:g} s")
        )

    def logs(self) -> list[LogEntry]:
        """Return what the viewer said, oldest first."""
        return self._client.get_logs()

    def close(self) -> None:
        """Stop the process; asking twice does no harm."""
        _stop(self._process)
        self._output.close()

    def _wait_for_client(self, port: str) -> ViewerClient:
        return _until(
            lambda: self._painting_client(f"rerun+http://{_LOCAL}:{port}/proxy"),
            _STARTING_S,
            f"rerun's viewer painted nothing within {_STARTING_S:g} s",
        )

    def _painting_client(self, url: str) -> ViewerClient | None:
        """Return a client that got a picture; only that proves that the graphics driver works."""
        if self._process.poll() is not None:
            raise WorkbenchError(
                f"rerun's viewer ended while starting; without a screen it needs a Vulkan driver "
                f"(on Debian: mesa-vulkan-drivers). It said: {self._last_words()}"
            )
        try:
            client = ViewerClient.connect(url)
            client.take_screenshot(max_size=64)
        except _ANSWERS:
            return None
        return client

    def _last_words(self) -> str:
        self._output.seek(0)
        lines = self._output.read().decode(errors="replace").splitlines()
        return next((line for line in lines if "panicked" in line), " ".join(lines[-1:]))


def open_viewer(path: Path, web: bool = False, progress: Progress = lambda text: None) -> None:
    """Show a recording until the user closes the viewer, or ends the web page's server by Ctrl-C.

    The recording stays on this computer either way. rerun's web page asks Google for a font, which
    it does without where there is no network.

    Args:
        path: the `.rrd` file.
        web: show it in the browser instead of a window.
        progress: receives the address of the web page.

    Raises:
        InputError: when there is no such recording.
        WorkbenchError: when the viewer ends with an error, or has no display for its window.
    """
    _existing(path)
    process = _start([str(path), *_window(web, progress)[1]])
    try:
        code = process.wait()
    except KeyboardInterrupt:
        return
    finally:
        _stop(process)
    if code:
        raise WorkbenchError(f"rerun's viewer ended with an error (exit code {code}); {_OTHERWISE}")


def start_viewer() -> str:
    """Open a window that shows what is sent to it and return its port; it stays when we end.

    Raises:
        WorkbenchError: when there is no display for it.
    """
    port, options = _window(False, lambda text: None)
    _start(options, subprocess.DEVNULL, apart=True)
    return port


def _window(web: bool, progress: Progress) -> tuple[str, list[str]]:
    """Return the port of a new viewer and the options that open its window, or page."""
    if not web and sys.platform == "linux" and not any(map(os.environ.get, _DISPLAYS)):
        raise WorkbenchError(f"there is no display here to open a window on; {_OTHERWISE}")
    # A port of its own, or a viewer that is open already would be asked to show the recording.
    port = _free_port()
    options = ["--port", port, "--hide-welcome-screen"]
    if web:
        page = _free_port()
        options += ["--web-viewer", "--web-viewer-port", page]
        source = quote(f"rerun+http://{_LOCAL}:{port}/proxy", safe="")
        progress(f"in the browser: http://{_LOCAL}:{page}/?url={source}\nCtrl-C ends it")
    return port, options


def _existing(path: Path) -> Path:
    if not path.is_file():
        raise InputError(f"no recording at {path}; make it again from the run's bundle")
    return path


def _start(
    arguments: list[str], output: int | None = None, *, apart: bool = False
) -> subprocess.Popen[bytes]:
    """Start the viewer's own program, not the script around it, so that one process is all.

    Args:
        arguments: of the program.
        output: where it writes; None where we do.
        apart: out of reach of this terminal's Ctrl-C.
    """
    quiet = (
        {"RUST_LOG": "error"}
        | os.environ
        | {  # its log names ports and telemetry
            "CI": "1",  # rerun counts no usage and shows no first-use notice under CI
            "RERUN_APP_ONLY": "true",
        }
    )
    return subprocess.Popen(
        [_program(), "--bind", _LOCAL, *arguments],
        env=quiet,
        stdout=output,
        stderr=output,
        start_new_session=apart,
    )


def _stop(process: subprocess.Popen[bytes]) -> None:
    process.terminate()
    try:
        process.wait(_STOPPING_S)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


def viewer_version() -> str:
    """Start rerun's viewer for its version alone, and return it, such as `0.41.0`.

    Raises:
        WorkbenchError: when there is none, or it does not start.
    """
    program = _program()
    try:
        done = subprocess.run(
            [program, "--version"], capture_output=True, text=True, timeout=_VERSION_S, check=True
        )
    except (OSError, subprocess.SubprocessError) as error:
        raise WorkbenchError(f"rerun's viewer does not start: {error}") from None
    found = re.search(r"\d+\.\d+\.\d+", done.stdout)
    if found is None:
        raise WorkbenchError(f"rerun's viewer reports no version but {done.stdout.strip()!r}")
    return found.group()


def _program() -> Path:
    folder = Path(rerun_cli.__file__).parent
    locations = ("rerun", "rerun.exe", "Rerun.app/Contents/MacOS/Rerun")
    found = [folder / location for location in locations if (folder / location).is_file()]
    if not found:
        raise WorkbenchError(f"rerun-sdk has no viewer in {folder}; reinstall rerun-sdk")
    return found[0]


def _free_port() -> str:
    with socket.socket() as probe:
        probe.bind((_LOCAL, 0))
        return str(probe.getsockname()[1])


def _loaded(state: ViewerState) -> ViewerState | None:
    return state if state.active_recording and not state.loading else None


def _until(attempt: Callable[[], _T | None], deadline_s: float, complaint: str) -> _T:
    end = time.monotonic() + deadline_s
    while time.monotonic() < end:
        result = attempt()
        if result is not None:
            return result
        time.sleep(_POLL_S)
    raise WorkbenchError(complaint)
