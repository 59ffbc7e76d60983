"""Workbench for a curved-beam hopping robot: run, track, simulate, compare.

For notebooks: `import workbench as wb`, then what `__all__` lists; `docs/reference/python.md` is a
tour. Each name is loaded from the room `api` when it is first used, so that the import is cheap.

Rooms in their layers, from the top: `cli`, `api`, `doctor`; `panel`, `report`; `mechanism`,
`investigate`, `diagnose`, `run`, `identify`, `design`, `template`, `as_built`; `data_quality`,
`twin`, `live`, `fit`; `hw`, `tracking`, `sim`, `photo`, `optimize`; `bundle`, `catalogue`,
`schemas`; `motion`; and what everybody may import, such as `errors`, `timeseries` and `shape`. A
room imports only from rooms below it, and only what they export; `lint-imports` and
`tests/test_rooms.py` hold that.
"""

from typing import TYPE_CHECKING

from workbench.room_exports import exports

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

if not TYPE_CHECKING:  # a type checker reads the imports
    __getattr__, __dir__, __all__ = exports(__name__)
