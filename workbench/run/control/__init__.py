"""The control server: a run that is under way is seen, answered and stopped from other processes.

What lives here: the session file that says who carries out an experiment, which the system unlocks
when that process dies (`session.py`); the server itself, on loopback in the run's process
(`server.py`); and the calls of another process (`client.py`). What does not: pages
(`panel`), the terminal (`cli`), and what a run does (`engine`). Nothing here ever makes a run
wait: it publishes what it is doing and goes on.

    with open_control_server(runs, experiment, facts) as server:
        server.show_phase("rest 2 s")                     # seen by whoever watches
        with server.ask("Clamp the foot.", typed=False) as question:
            question.wait(0.1)                            # a Reply, or None so far

To show one more thing: one field of `server.PublishedState`, one method that changes it.
"""

from typing import TYPE_CHECKING

from workbench.room_exports import exports
from workbench.run.control.client import answer, pause, press_stop, watch
from workbench.run.control.server import ControlServer, PendingPrompt, Reply, open_control_server
from workbench.run.control.session import SessionFile, claim, holder, session_files

if not TYPE_CHECKING:  # a type checker reads the imports
    __getattr__, __dir__, __all__ = exports(__name__)
