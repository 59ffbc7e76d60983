"""A picture of a recording as the viewer shows it, taken without a window."""

from __future__ import annotations

import io
import tempfile
import time
from pathlib import Path

from PIL import Image

from workbench.report.viewer import HeadlessViewer

__all__ = ["as_jpeg", "picture_recording"]

_SETTLE_S = 6.0  # the viewer's notices of its first seconds are gone by then
_QUALITY = 82


def picture_recording(
    recording: Path, moment_s: float, size: tuple[int, int] = (1600, 1000)
) -> Image.Image:
    """Return the viewer's whole window with a recording.

    Args:
        recording: the `.rrd` file.
        moment_s: position of the time cursor [s].
        size: width and height of the window [px].

    Raises:
        WorkbenchError: when the viewer does not start here, or does not load the recording.
    """
    with HeadlessViewer(*size) as viewer, tempfile.TemporaryDirectory() as folder:
        viewer.open(recording)
        viewer.set_time(moment_s)
        time.sleep(_SETTLE_S)
        png = Path(folder) / "window.png"
        viewer.screenshot(png)
        with Image.open(png) as shot:
            return shot.convert("RGB")


def as_jpeg(image: Image.Image) -> bytes:
    """Return a picture as JPEG, small enough to be part of a page."""
    data = io.BytesIO()
    image.save(data, "JPEG", quality=_QUALITY, optimize=True)
    return data.getvalue()
