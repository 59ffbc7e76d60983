"""Keep a beam as it was bent as a shape file."""

from __future__ import annotations

import io
from pathlib import Path

from ruamel.yaml import YAML
from ruamel.yaml.comments import CommentedMap, CommentedSeq

from workbench.errors import InputError
from workbench.photo import AsBent
from workbench.schemas import Document, ShapeFile, parse

__all__ = ["write_as_bent"]

_ANGLE_DIGITS = 5  # 1e-5 rad is far below any reading
_WIDTH = 10_000  # characters: one line a list


def write_as_bent(path: Path, bent: AsBent, target: ShapeFile) -> Document[ShapeFile]:
    """Write the beam as a shape file, and return it as read back.

    Args:
        path: of the new file.
        bent: as it was read.
        target: what it was bent to; length, thickness and width are its.

    Raises:
        InputError: when the file exists or cannot be written.
        FileFaults: when the angles are none that a shape can have.
    """
    if path.exists():
        raise InputError(f"{path}: exists; a shape is never changed, give another --out")
    yaml = YAML()
    yaml.width = _WIDTH
    stream = io.StringIO()
    yaml.dump(_tree(path, bent, target), stream)
    document = parse(path, stream.getvalue(), ShapeFile)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(stream.getvalue(), encoding="utf-8", newline="\n")
    except OSError as error:
        raise InputError(f"{path}: cannot be written: {error.strerror}") from None
    return document


def _tree(path: Path, bent: AsBent, target: ShapeFile) -> CommentedMap:
    tree = CommentedMap()
    tree["schema"] = "workbench/shape-1"
    tree["name"] = path.stem
    tree["angles"] = _row(bent.angles.tolist())
    tree["length"] = f"{1000 * target.length:.10g} mm"
    for key in ("thickness", "width"):
        size = getattr(target, key)
        if size is not None:
            tree[key] = f"{1000 * size:.10g} mm"
    tree["state"] = "unloaded"
    if bent.uncertainty is not None:
        tree["uncertainty"] = _row(bent.uncertainty.tolist())
    foot = "" if bent.foot_seen else "; alpha_0 is the target's, the strip alone does not show it"
    tree["source"] = f"as bent to {target.name}, {bent.source}{foot}"
    return tree


def _row(numbers: list[float]) -> CommentedSeq:
    row = CommentedSeq([round(number, _ANGLE_DIGITS) for number in numbers])
    row.fa.set_flow_style()
    return row
