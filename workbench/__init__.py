"""Workbench for a curved-beam hopping robot: run, track, simulate, compare.

For notebooks: `import workbench as wb`, then what `__all__` lists; `docs/reference/python.md` is a
tour. Each name is loaded from the room `api` when it is first used, so that the import is cheap.

Rooms, from the top: `cli`, `api`, `engine`, `review`, `bench`, then side by side `hw`, `tracking`
and `sim`, then `shape`, `bundle` and `protocol`, `motion`, `timeseries`, `errors`. A room imports
only from rooms below it; `lint-imports` holds that.
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
        from importlib import import_module

        if name in __all__:
            return getattr(import_module("workbench.api"), name)
        near = import_module("workbench.errors").did_you_mean(name, __all__)
        raise AttributeError(f"module 'workbench' has no attribute {name!r}{near}")


def __dir__() -> list[str]:
    """Return what is for users."""
    return __all__
