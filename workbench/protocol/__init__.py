"""Every YAML file that the workbench reads, as a frozen schema, and the plan made from a protocol.

`files.load` reads a file and reports all its faults at once with line, column and caret; one file
here for each schema. Nothing is opened but the file itself, nothing is switched. To add a key: add
the field with its docstring, run `make schemas`, and describe it in docs/reference/files.md.
"""

from workbench.protocol.bench import BenchFile, CameraSettings, ConnectionSettings, VirtualSection
from workbench.protocol.calibration import Calibration, CalibrationFile, MotorLine, calibration_text
from workbench.protocol.experiment import Mode, PartFile, Protocol, Role
from workbench.protocol.files import Document, load, parse
from workbench.protocol.identified import Identified, identifications, identified_source
from workbench.protocol.library import builtin_names, load_model, load_shape, with_calibration
from workbench.protocol.model import UNITS, ModelFile, value_fault
from workbench.protocol.parts import Parts, load_protocol
from workbench.protocol.plan import (
    Item,
    Level,
    Named,
    Plan,
    PlannedDrive,
    PlannedPause,
    PlannedPrompt,
    PlannedRun,
)
from workbench.protocol.planner import make_plan
from workbench.protocol.prompt import Answer, PromptQuestion
from workbench.protocol.quantity import DIMENSIONS, parse_quantity
from workbench.protocol.release import PlannedRelease
from workbench.protocol.rewrite import rounded, write_changed
from workbench.protocol.rig import (
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
from workbench.protocol.section import Section
from workbench.protocol.shape import ShapeFile
from workbench.protocol.sheet import Sheet, SheetRun
from workbench.protocol.stop import StopWhen

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
    "value_fault",
    "with_calibration",
    "write_changed",
]
