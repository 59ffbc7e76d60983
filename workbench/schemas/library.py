"""The models and shapes that come with the workbench, and how a file named by another is found."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from workbench.errors import InputError, did_you_mean
from workbench.schemas.bench import BenchFile
from workbench.schemas.calibration import CalibrationFile
from workbench.schemas.files import Document, load
from workbench.schemas.model import ModelFile
from workbench.schemas.shape import ShapeFile

__all__ = ["builtin_folder", "builtin_names", "load_model", "load_shape", "with_calibration"]


def builtin_folder() -> Path:
    """Return the folder of the built-in models: inside a wheel, else the checkout's `models/`."""
    package = Path(__file__).resolve().parents[1]
    inside = package / "models"
    return inside if inside.is_dir() else package.parent / "models"


def builtin_names(kind: str) -> list[str]:
    """Return the names of all built-in models or shapes.

    Args:
        kind: `model` or `shape`.
    """
    files = sorted(builtin_folder().glob("*.yaml"))
    return [f.stem for f in files if f"schema: workbench/{kind}-1" in f.read_text("utf-8")]


def load_model(name: str, beside: Path) -> Document[ModelFile]:
    """Read a model by name or path.

    Args:
        name: a built-in name such as `thesis`, or a path from the folder of the file that names it.
        beside: that folder.

    Raises:
        InputError: when there is none of that name; lists those that exist.
        FileFaults: when the file has faults.
    """
    return load(_find(name, beside, "model"), ModelFile)


def load_shape(name: str, beside: Path) -> Document[ShapeFile]:
    """Read a shape by name or path; arguments and errors as for `load_model`."""
    return load(_find(name, beside, "shape"), ShapeFile)


def with_calibration(bench: Document[BenchFile], file: Path | None = None) -> Document[BenchFile]:
    """Return a bench with the calibration that it names read into it; another as it is.

    Args:
        bench: as read.
        file: where that calibration is kept; by default where the bench says, from its own folder.

    Raises:
        InputError: when there is no such file.
        FileFaults: when the file has faults.
    """
    named = bench.content.calibration
    if not isinstance(named, str):
        return bench
    path = file or bench.path.parent / named
    if not path.exists():
        near = [other.name for other in path.parent.glob("*.yaml")]
        raise InputError(
            f"{path}: no such file{did_you_mean(path.name, near)}; "
            f"{bench.path} names it as its calibration; `workbench calibrate RUNS` makes one"
        )
    line = load(path, CalibrationFile).content
    return replace(bench, content=bench.content.model_copy(update={"calibration": line}))


def _find(name: str, beside: Path, kind: str) -> Path:
    if name.endswith((".yaml", ".yml")):
        return beside / name
    names = builtin_names(kind)
    if name in names:
        return builtin_folder() / f"{name}.yaml"
    raise InputError(
        f"no {kind} named {name!r}{did_you_mean(name, names)}; "
        f"built in: {', '.join(names)}; a path must end in .yaml"
    )
