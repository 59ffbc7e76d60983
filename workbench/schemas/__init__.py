"""Every YAML file that the workbench reads, as a frozen schema, and the plan made from a protocol.

`files.load` reads a file and reports all its faults at once with line, column and caret; one file
here for each schema. Nothing is opened but the file itself, nothing is switched. To add a key: add
the field with its docstring, run `make schemas`, and describe it in docs/reference/files.md.
"""

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

SCHEMAS: dict[str, type[Section]] = {
    "protocol": Protocol,
    "part": PartFile,
    "bench": BenchFile,
    "sheet": Sheet,
    "model": ModelFile,
    "shape": ShapeFile,
    "calibration": CalibrationFile,
    "rig": RigFile,
}
"""Name for `workbench schema NAME` -> schema."""

__all__ = [
    "DIMENSIONS",
    "MOST_BYTES",
    "SCHEMAS",
    "UNITS",
    "Answer",
    "BenchFile",
    "Calibration",
    "CalibrationFile",
    "CameraSettings",
    "ChannelEffect",
    "ConnectionSettings",
    "Document",
    "Identified",
    "InputEffect",
    "Item",
    "JointEffect",
    "Level",
    "Location",
    "Mode",
    "ModelFile",
    "MotorLine",
    "Named",
    "PartFile",
    "Parts",
    "Plan",
    "PlannedDrive",
    "PlannedPause",
    "PlannedPrompt",
    "PlannedRelease",
    "PlannedRun",
    "PromptQuestion",
    "Protocol",
    "Ramps",
    "RigChannel",
    "RigField",
    "RigFile",
    "RigFound",
    "RigInput",
    "RigParameter",
    "RigRun",
    "RigStart",
    "Role",
    "Section",
    "ShapeFile",
    "Sheet",
    "SheetRun",
    "StopWhen",
    "VirtualSection",
    "builtin_folder",
    "builtin_names",
    "calibration_text",
    "identifications",
    "identified_source",
    "load",
    "load_model",
    "load_protocol",
    "load_shape",
    "make_plan",
    "parse",
    "parse_quantity",
    "rounded",
    "tree_of",
    "value_fault",
    "with_calibration",
    "write_changed",
]
