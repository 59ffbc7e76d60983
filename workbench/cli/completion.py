"""Completion by the Tab key: bundles, protocols, benches, models and shapes, by file names."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path

__all__ = ["bench_names", "model_names", "protocol_files", "run_names", "shape_names"]

_HEAD_BYTES = 2048  # the schema of a file is near its top


def run_names(incomplete: str) -> list[str]:
    """Return the names of bundles, newest first."""
    folder = Path(os.environ.get("WORKBENCH_RUNS", "runs"))
    from workbench.bundle import bundle_names  # only where a run is typed

    return _beginning(incomplete, reversed(bundle_names(folder)))


def protocol_files(incomplete: str) -> list[str]:
    """Return the protocols beside what is typed, and in `protocols`."""
    return _beginning(incomplete, _files(incomplete, "protocol", Path("protocols")))


def bench_names(incomplete: str) -> list[str]:
    """Return the built-in bench, and bench files beside what is typed."""
    return _beginning(incomplete, ["virtual", *_files(incomplete, "bench", Path())])


def model_names(incomplete: str) -> list[str]:
    """Return the built-in models, and model files beside what is typed."""
    return _names(incomplete, "model")


def shape_names(incomplete: str) -> list[str]:
    """Return the built-in shapes, and shape files beside what is typed."""
    return _names(incomplete, "shape")


def _names(incomplete: str, kind: str) -> list[str]:
    from workbench.schemas import builtin_names  # only where one is typed

    return _beginning(incomplete, [*builtin_names(kind), *_files(incomplete, kind, Path())])


def _files(incomplete: str, kind: str, usual: Path) -> list[str]:
    """Return the YAML files of a kind in the folder that is being typed, else in the usual one."""
    folder = Path(incomplete).parent if os.sep in incomplete else usual
    found = [path for path in sorted(folder.glob("*.yaml")) if _is(path, kind)]
    return [path.as_posix() for path in found]


def _is(path: Path, kind: str) -> bool:
    try:
        with path.open("rb") as file:
            return f"schema: workbench/{kind}-".encode() in file.read(_HEAD_BYTES)
    except OSError:
        return False


def _beginning(incomplete: str, words: Iterable[str]) -> list[str]:
    return [word for word in words if word.startswith(incomplete)]
