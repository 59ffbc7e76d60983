"""Frames as a file to show: H.264 in an `.mp4`, or a folder of PNGs."""

from __future__ import annotations

from pathlib import Path
from types import ModuleType

from PIL import Image

from workbench.errors import InputError
from workbench.progress import Progress, reached
from workbench.report.comparison import Comparison
from workbench.report.film.frames import Film, film

__all__ = ["write_frames", "write_video"]

_CODECS = ("libx264", "libopenh264", "mpeg4")  # the first one that this build of FFmpeg has
_QUALITY = {"libx264": {"crf": "20", "preset": "veryfast"}}


def write_video(comparison: Comparison, path: Path, how: Film, progress: Progress) -> None:
    """Film a run into an `.mp4` that every browser and slide program plays.

    Args:
        comparison: the run.
        path: of the film; one that is there is replaced when the new one is whole.
        how: pace and size.
        progress: receives each frame.

    Raises:
        InputError: when the name does not end in .mp4, the extra `video` is not installed, or
            nothing of the run moves.
        WorkbenchError: when nothing renders here without a window.
    """
    if path.suffix.lower() != ".mp4":
        raise InputError(f"{path}: a film is written as .mp4")
    av = _encoder()
    codec = next(name for name in _CODECS if name in av.codecs_available)
    draft = path.with_name(f".{path.name}")
    count = len(how.times(comparison))
    try:
        with (
            film(comparison, how) as frames,
            av.open(str(draft), "w", format="mp4", options={"movflags": "faststart"}) as container,
        ):
            stream = container.add_stream(codec, rate=how.rate_hz, options=_QUALITY.get(codec, {}))
            stream.width, stream.height, stream.pix_fmt = how.width, how.height, "yuv420p"
            for done, (_, picture) in enumerate(frames, start=1):
                container.mux(stream.encode(av.VideoFrame.from_ndarray(picture, format="rgb24")))
                progress(reached("frame", done, count))
            container.mux(stream.encode(None))
        draft.replace(path)
    finally:
        draft.unlink(missing_ok=True)


def write_frames(comparison: Comparison, folder: Path, how: Film, progress: Progress) -> None:
    """Film a run into a new folder, `frame_00000.png` and so on.

    Raises:
        InputError: when the folder holds something already, or nothing of the run moves.
        WorkbenchError: when nothing renders here without a window.
    """
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise InputError(f"{folder}: holds something already; name a folder that is new or empty")
    count = len(how.times(comparison))
    with film(comparison, how) as frames:
        folder.mkdir(parents=True, exist_ok=True)
        for done, (_, picture) in enumerate(frames, start=1):
            Image.fromarray(picture).save(folder / f"frame_{done - 1:05d}.png")
            progress(reached("frame", done, count))


def _encoder() -> ModuleType:
    try:
        import av
    except ImportError:
        raise InputError(
            "a film needs the extra `video`: pip install hopping-workbench[video]; "
            "--frames FOLDER writes single pictures without it"
        ) from None
    return av
