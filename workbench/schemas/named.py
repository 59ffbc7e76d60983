"""The schemas by the names that `workbench schema` knows."""

from __future__ import annotations

from workbench.schemas.bench import BenchFile
from workbench.schemas.calibration import CalibrationFile
from workbench.schemas.experiment import PartFile, Protocol
from workbench.schemas.model import ModelFile
from workbench.schemas.rig import RigFile
from workbench.schemas.section import Section
from workbench.schemas.shape import ShapeFile
from workbench.schemas.sheet import Sheet

__all__ = ["SCHEMAS"]

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
