"""The catalogue: finding, comparing and handing on runs among thousands of bundles.

Here live the index (`index.py`, one SQLite file in the folder of all bundles), what it knows of a
run (`entry.py`), what changes from run to run (`trends.py`, imported by itself, as it needs numpy),
what can be asked (`query.py`), what two runs differ in (`differences.py`), and
export for colleagues (`export.py`). What does not: the bundles themselves and what people said of
them (`bundle`). The disk is the truth and the index a cache: whoever deletes it loses nothing.

To make one more fact searchable: a field in `Entry`, where it comes from in `read_entry`, its
condition in `query.py`, an option in `cli/runs.py`, and another `_VERSION` in `index.py`.
"""

from workbench.catalogue.entry import UNREADABLE, Entry, describe
from workbench.catalogue.index import SearchResult, rebuild, search
from workbench.catalogue.query import SORTS, NumberRange, Query, period, window

__all__ = [
    "SORTS",
    "UNREADABLE",
    "Entry",
    "NumberRange",
    "Query",
    "SearchResult",
    "describe",
    "period",
    "rebuild",
    "search",
    "window",
]
