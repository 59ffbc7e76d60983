"""Films and single pictures of a run, rendered by MuJoCo without a window.

`stage` is floor, light and camera, and what of a robot is on it at an instant; `offscreen`
finds a graphics driver that renders where there is no screen; `caption` writes time, speed and
shape; `frames` goes through the run, `files` writes the frames as an `.mp4` or as PNGs. What is
shown comes from a `Comparison` alone: nothing is simulated. To show another thing on the stage, add
its geoms in `stage.py`; another file format is a function in `files.py`.
"""

from typing import TYPE_CHECKING

from workbench.report.film.files import write_frames, write_video
from workbench.report.film.frames import Film, film
from workbench.room_exports import exports

if not TYPE_CHECKING:  # a type checker reads the imports
    __getattr__, __dir__, __all__ = exports(__name__)
