"""The catalogue: finding, comparing and handing on runs among thousands of bundles.

Here live the index (`index.py`, one SQLite file in the folder of all bundles), what it knows of a
run (`entry.py`), what changes from run to run (`trend.py`, loaded when it is used, as it needs
numpy), what can be asked (`query.py`), what two runs differ in (`difference.py`), and export for
colleagues (`exported.py`). What does not: the bundles themselves and what people said of them
(`bundle`). The disk is the truth and the index a cache: whoever deletes it loses nothing.

To make one more fact searchable: a field in `Entry`, where it comes from in `read_entry`, its
condition in `query.py`, an option in `cli/runs.py`, and another `_VERSION` in `index.py`.
"""

from typing import TYPE_CHECKING

from workbench.catalogue.entry import UNREADABLE, Entry, describe
from workbench.catalogue.index import SearchResult, rebuild, search
from workbench.catalogue.query import SORTS, NumberRange, Query, period, window
from workbench.room_exports import exports

if TYPE_CHECKING:
    from workbench.catalogue.difference import ABSENT, Difference, differences
    from workbench.catalogue.exported import export
    from workbench.catalogue.trend import (
        Trend,
        beside_earlier,
        charted,
        condition_of,
        conditions,
        trends,
    )

if not TYPE_CHECKING:  # a type checker reads the imports
    __getattr__, __dir__, __all__ = exports(__name__)
