"""How files are written: never half, and with a message that ends the search."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from workbench.errors import RecordError

__all__ = ["record_errors", "replaced"]


@contextmanager
def record_errors(path: Path) -> Iterator[None]:
    """Say which file could not be written, and what to do.

    Raises:
        RecordError: in place of an OSError of the block.
    """
    try:
        yield
    except OSError as error:
        raise RecordError(
            f"{path}: cannot be written ({error.strerror or error}); free the disk or choose "
            "another folder with --runs"
        ) from error


@contextmanager
def replaced(path: Path) -> Iterator[Path]:
    """Yield a draft beside a file; it takes the file's place when the block ends well.

    A draft that cannot be finished is removed, which also frees a full disk for the last words.

    Raises:
        RecordError: when it cannot be written.
    """
    draft = path.with_name(f".{path.name}")
    with record_errors(path):
        try:
            yield draft
            os.replace(draft, path)
        except BaseException:
            draft.unlink(missing_ok=True)
            raise
