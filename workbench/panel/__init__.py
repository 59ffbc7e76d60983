"""The panel: one local page that starts runs, shows the one that is under way, and can stop it.

What lives here: who carries out a run (`controller.py`), what its bundle shows while it grows
(`following.py`), the list of runs (`listing.py`), all of them with comparison and trends
(`runs.py`, `charts.py`), what may be started and how (`protocols.py`, `starting.py`), the times
(`estimate.py`), what came of a run (`result.py`), what the page shows (`view.py`, kept up to date
by `watcher.py`), the web server (`server.py`, `guard.py`) and the page itself (`page/`). What does
not: anything that drives. A run is a process of its own, also where it was started here: the panel
reads what it writes, and speaks to its server in `control`. It is no safety device.

To show one more thing: one key in `view.py`, one line in `page/panel.js`, one test.
"""

from typing import TYPE_CHECKING

from workbench.panel.protocols import Protocols
from workbench.panel.server import Panel
from workbench.panel.starting import Starter
from workbench.panel.watcher import Watcher
from workbench.room_exports import exports

if not TYPE_CHECKING:  # a type checker reads the imports
    __getattr__, __dir__, __all__ = exports(__name__)
