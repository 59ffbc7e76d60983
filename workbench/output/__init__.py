"""Whether a supply's output is on: what is known of it, and where that is kept.

What lives here: the fold that every reader asks (`state.py`), and the ledger of a supply, which
outlives every program that drives it and refuses the next one when the last left a doubt
(`ledger.py`). What does not: anything that speaks to a supply; that is `hw`.

    fold(events).description  a sentence for people
    Ledger(key).latch()       why nothing may be driven, or None
"""

from typing import TYPE_CHECKING

from workbench.output.ledger import Latch, Ledger, ledgers, state_folder
from workbench.output.state import BY_HAND, FOUND, MAY_BE_ON, OutputState, State, after, fold
from workbench.room_exports import exports

if not TYPE_CHECKING:  # a type checker reads the imports
    __getattr__, __dir__, __all__ = exports(__name__)
