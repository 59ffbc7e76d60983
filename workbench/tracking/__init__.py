"""Tracking: OptiTrack exports and streams in, tracks out, exports written for the virtual bench.

Here are the readers of every export format, the recorder of a NatNet stream, the report on a raw
take, the axis mapping, the cleaning recipes, and the way from a take to the motion of foot, T and
rotor. No instruments, no simulation, no bundle folder: this room imports `motion`, `timeseries` and
`errors` only.

The way of the data: `read_take` -> `Take` (the file's axes, nothing filtered) -> `with_overrides`
(by a sheet) -> `raw_points` (bench axes) -> a recipe of `CLEANING` -> `make_track` -> `Track`.

To add a file format: one parser `Source -> Take`, one line in `reader.py`, one test file.
To add a cleaning recipe: one function `RawPoints -> Cleaned` in its own file, one entry in
`CLEANING`, one test.
"""

from typing import TYPE_CHECKING

from workbench.room_exports import exports
from workbench.tracking.alignment import ClockFit, Delay, clock_fit, delay
from workbench.tracking.axes import Axes
from workbench.tracking.bodies import MarkerPlaces, RawBody, RawPoints, raw_points
from workbench.tracking.body_names import BodyNames, guess_bodies
from workbench.tracking.causal import FramePoints
from workbench.tracking.cleaning import CLEANING
from workbench.tracking.exchanges import Exchange
from workbench.tracking.floor import Floor, fit_floor
from workbench.tracking.motive_writer import write_motive
from workbench.tracking.natnet_frames import Body, Sample
from workbench.tracking.natnet_recorder import Recorder, Stream, record
from workbench.tracking.noise import ChannelNoise, Harmonics, noise_floor, synchronous
from workbench.tracking.overrides import Overrides, with_overrides
from workbench.tracking.quality import exports_in, quality, quality_or_error
from workbench.tracking.reader import read_take
from workbench.tracking.recipe import BodyReport, Cleaned, CleaningReport, Recipe
from workbench.tracking.rotor import RotorAngle, RotorSpeed, Turns, mean_speed, turns, unwrapped
from workbench.tracking.row_writer import write_row
from workbench.tracking.start_time import format_start_time
from workbench.tracking.take import BodyTake, Cloud, SampleStatus, Take
from workbench.tracking.track import Track, make_track

if not TYPE_CHECKING:  # a type checker reads the imports
    __getattr__, __dir__, __all__ = exports(__name__)
