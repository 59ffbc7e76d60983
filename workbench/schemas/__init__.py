"""Every YAML file that the workbench reads, as a frozen schema, and the plan made from a protocol.

`files.load` reads a file and reports all its faults at once with line, column and caret; one file
here for each schema. Nothing is opened but the file itself, nothing is switched. To add a key: add
the field with its docstring, run `make schemas`, and describe it in docs/reference/files.md.
"""

from typing import TYPE_CHECKING

from workbench.room_exports import exports
from workbench.schemas.bench import BenchFile, CameraSettings, ConnectionSettings, VirtualSection
from workbench.schemas.calibration import Calibration, CalibrationFile, MotorLine, calibration_text
from workbench.schemas.experiment import Mode, PartFile, Protocol, Role
from workbench.schemas.files import Document, Location, load, parse
from workbench.schemas.identified import Identified, identifications, identified_source
from workbench.schemas.library import (
    builtin_folder,
    builtin_names,
    load_model,
    load_shape,
    with_calibration,
)
from workbench.schemas.model import UNITS, ModelFile, value_fault
from workbench.schemas.named import SCHEMAS
from workbench.schemas.parts import Parts, load_protocol
from workbench.schemas.plan import (
    Item,
    Level,
    Named,
    Plan,
    PlannedDrive,
    PlannedPause,
    PlannedPrompt,
    PlannedRun,
)
from workbench.schemas.planner import make_plan
from workbench.schemas.prompt import Answer, PromptQuestion
from workbench.schemas.quantity import DIMENSIONS, parse_quantity
from workbench.schemas.ramps import Ramps
from workbench.schemas.release import PlannedRelease
from workbench.schemas.rewrite import rounded, write_changed
from workbench.schemas.rig import (
    ChannelEffect,
    InputEffect,
    JointEffect,
    RigChannel,
    RigField,
    RigFile,
    RigFound,
    RigInput,
    RigParameter,
    RigRun,
    RigStart,
)
from workbench.schemas.section import Section
from workbench.schemas.shape import ShapeFile
from workbench.schemas.sheet import Sheet, SheetRun
from workbench.schemas.stop import StopWhen
from workbench.schemas.tree import MOST_BYTES, tree_of

if not TYPE_CHECKING:  # a type checker reads the imports
    __getattr__, __dir__, __all__ = exports(__name__)
