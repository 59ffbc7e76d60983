"""The command line: one file a verb; each parses, calls the rooms below and prints, nothing else.

Results go to stdout (with `--json` one object), text for people about the progress to stderr.
Errors of `workbench.errors` end with their exit code and their message, without a traceback. To
add a verb: one file with a function, and its name and sentence in `VERBS` of `app.py`; it is
imported when it is called.
"""

import os
from typing import TYPE_CHECKING

from workbench.room_exports import exports

# no plugin of pydantic is used, and the search for them costs every command 20 ms
os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")
# matrices here are small: more threads only wait for each other, 0.5 CPU s in a run
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from workbench.cli.app import main

if not TYPE_CHECKING:  # a type checker reads the imports
    __getattr__, __dir__, __all__ = exports(__name__)
