"""Workbench for a curved-beam hopping robot: run, track, simulate, compare.

For notebooks: `import workbench as wb`, then what `__all__` lists; `docs/reference/python.md` is a
tour. Each name is loaded from the room `api` when it is first used, so that the import is cheap.

Rooms in their layers, from the top: `cli`, `api`, `doctor`; `panel`, `report`; `run`, `identify`,
`diagnose`, `design`, `template`, `as_built`; `twin`, `live`, `fit`; `hw`, `tracking`, `sim`,
`photo`, `optimize`; `bundle`, `catalogue`, `schemas`; `motion`; and what everybody may import, such
as `errors`, `timeseries` and `shape`. A room imports only from rooms below it, and only what they
export; `lint-imports` and `tests/test_rooms.py` hold that.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from workbench.api import (
        Run,
        Runs,
        Simulated,
        ingest_sheet,
        open_run,
        open_runs,
        optimize_shape,
        read_take,
        run_protocol,
        simulate,
        take_quality,
    )

__all__ = [
    "Run",
    "Runs",
    "Simulated",
    "ingest_sheet",
    "open_run",
    "open_runs",
    "optimize_shape",
    "read_take",
    "run_protocol",
    "simulate",
    "take_quality",
]


if not TYPE_CHECKING:  # a type checker knows the names, and should miss others

    def __getattr__(name: str) -> Any:
        """Load a name of the room `api` when it is first used."""
        from workbench.lazy_names import lazy_names

        return lazy_names(__name__, {"api": __all__})(name)


def __dir__() -> list[str]:
    """Return what is for users."""
    return __all__
