"""Whether this computer is ready: packages, viewer, ports, disk and clock.

Each file looks at one thing and returns a `Finding`: what was found, and what to do where it is not
right. Nothing is changed and nothing is switched; of a bench's supply only the model is read. To
add a check: a function without arguments, or of a folder, and its line in `examine`.
"""

from typing import TYPE_CHECKING

from workbench.doctor.examine import examine
from workbench.doctor.finding import Finding, State
from workbench.room_exports import exports

if not TYPE_CHECKING:  # a type checker reads the imports
    __getattr__, __dir__, __all__ = exports(__name__)
