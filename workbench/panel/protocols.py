"""The protocols of a folder that runs may be started from: what is listed, and nothing else."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

from workbench.bundle import foreign
from workbench.errors import InputError

__all__ = ["Protocols"]

_KIND = re.compile(rb"^schema:\s*workbench/([a-z]+)-", re.MULTILINE)
_HEAD_BYTES = 2048  # a file says what it is near its top


class Protocols:
    """The protocols that lie in one folder, and the bench that they are carried out on.

    Args:
        folder: of the protocols; what lies in folders below it is not served.
        bench: path of a bench file, or `virtual`.
    """

    def __init__(self, folder: Path, bench: str) -> None:
        self.folder, self.bench = folder, bench

    def path_of(self, name: str) -> Path | None:
        """Return a protocol by its file's name; None when none of that name is listed.

        A name is looked up among those listed, never joined to a path, so it leads nowhere else.
        """
        path = next((one for one in self._files() if one.name == name), None)
        return None if path is None or foreign(path) is not None else path

    def rows(self) -> dict[str, Any]:
        """Return the folder, the bench, and each protocol with its plan in short, or its fault."""
        from workbench.run import load_bench, make_bench  # no page needs them before

        head = {"folder": str(self.folder), "bench": self.bench, "supply": "", "error": ""}
        if not self.folder.is_dir():
            why = f"{self.folder}: no such folder; name one: workbench panel FOLDER"
            return head | {"error": why, "rows": []}
        try:
            lab = load_bench(self.bench)
            step = make_bench(lab.content).voltage_step
        except InputError as error:
            return head | {"error": str(error), "rows": []}

        def row(path: Path) -> dict[str, Any]:
            from workbench.schemas import load_protocol, make_plan

            entry: dict[str, Any] = {"name": path.name, "title": path.name, "error": ""}
            if (what := foreign(path)) is not None:
                return entry | {"error": f"{path}: is {what}; only files of the folder are served"}
            try:
                asked, parts = load_protocol(path)
                plan = make_plan(asked, lab.content, step, parts)
            except InputError as error:
                return entry | {"error": str(error)}
            modes = list(dict.fromkeys(run.mode for run in plan.runs))
            return entry | {
                "title": plan.title,
                "modes": modes,
                "runs": len(plan.runs),
                "seconds": plan.seconds,
                "prompts": plan.prompts,
            }

        facts = {"bench": lab.content.name, "supply": lab.content.supply.model}
        rows = sorted(map(row, self._files()), key=lambda one: bool(one["error"]))
        return head | facts | {"rows": rows}

    def _files(self) -> Iterator[Path]:
        """Yield the YAML files of the folder that do not say that they are something else."""
        found = sorted(self.folder.iterdir()) if self.folder.is_dir() else []
        for path in found:
            if path.suffix in (".yaml", ".yml") and not path.is_dir() and _may_be_protocol(path):
                yield path


def _may_be_protocol(path: Path) -> bool:
    if foreign(path) is not None:  # it is listed with what it is, and never read
        return True
    with suppress(OSError), path.open("rb") as file:
        kind = _KIND.search(file.read(_HEAD_BYTES))
        return kind is None or kind[1] == b"protocol"
    return True
