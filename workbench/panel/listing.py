"""The runs of a folder, read again only where something changed."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from typing import Any

from workbench.bundle import Bundle, View, foreign, judgements, passed
from workbench.errors import InputError

__all__ = ["MOST_ROWS", "Listing"]

MOST_ROWS = 100
"""How many runs the page lists; `workbench runs list` lists them all."""


class Listing:
    """All bundles of a folder, by name; each manifest is read when it is new or changed.

    Args:
        runs: the folder.
    """

    def __init__(self, runs: Path) -> None:
        self._runs = runs
        self._found: dict[str, tuple[int, Bundle]] = {}

    def refresh(self) -> None:
        """Look at the folder again; what is damaged is left out."""
        names = [path.name for path in self._runs.iterdir()] if self._runs.is_dir() else []
        self._found = {name: known for name in sorted(names) if (known := self._known(name))}

    def newest_of(self, experiment: str) -> Bundle | None:
        """Return the newest run of an experiment."""
        mine = self.of(experiment)
        return mine[-1] if mine else None

    def of(self, experiment: str) -> list[Bundle]:
        """Return the runs of an experiment, oldest first."""
        return [b for _, b in self._found.values() if b.experiment == experiment]

    def view_of(self, name: str, kind: View) -> Path | None:
        """Return a run's report or recording by the run's name; None when this folder has none.

        A name is looked up among those listed, never joined to a path, so it leads nowhere else.
        """
        _, bundle = self._found.get(name, (0, None))
        if bundle is None:
            return None
        view = bundle.view(kind)
        plain = foreign(bundle.path) is None and foreign(view) is None  # no way out by a link
        return view if plain and view.is_file() else None

    def rows(self) -> dict[str, Any]:
        """Return the newest runs, newest first, and how many there are."""
        bundles = [bundle for _, bundle in self._found.values()]
        newest = sorted(bundles, key=_age)[: -MOST_ROWS - 1 : -1]
        return {"rows": [self._row(bundle) for bundle in newest], "all": len(bundles)}

    def _row(self, bundle: Bundle) -> dict[str, Any]:
        asked, compared = bundle.manifest.asked, bundle.manifest.compared
        return {
            "name": bundle.path.name,
            "title": "" if asked is None else asked.title,
            "mode": "" if asked is None else asked.mode,
            "status": bundle.manifest.status if bundle.is_closed() else "not finished",
            "real_m": None if compared is None else compared.real.travel_m,
            "twin_m": None if compared is None else compared.twin.travel_m,
            "error_mm": None if compared is None else compared.error_mm,
            "passed": passed(judgements(bundle.manifest)),
            "report": self.view_of(bundle.path.name, "report") is not None,
        }

    def _known(self, name: str) -> tuple[int, Bundle] | None:
        """Return a bundle with the time of its last change, read again where that is new."""
        path = self._runs / name
        with suppress(InputError, OSError):
            changed = path.stat().st_mtime_ns  # its manifest is replaced, not rewritten
            before = self._found.get(name)
            if before is not None and before[0] == changed:
                return before
            return changed, Bundle.open(path)
        return None


def _age(bundle: Bundle) -> tuple[str, str]:
    return bundle.manifest.created, bundle.path.name
