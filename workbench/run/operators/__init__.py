"""Operators: who answers the prompts of a bench.

The contract is `workbench.run.takes.Operator`. Here are the two that keep it: `terminal` is the
person at a terminal, or at a page that shows the run, whoever answers first; `quiet` answers
itself, where nobody is to be asked. `keyboard` reads the terminal. Which of them a bench has is
`operator_of`.

Nothing is printed here: whoever makes an operator hands in where its words are shown. A new one is
a file with a class that keeps the contract, and a line in `operator_of`.
"""

from typing import TYPE_CHECKING

from workbench.room_exports import exports
from workbench.run.operators.choosing import operator_of
from workbench.run.operators.keyboard import Keyboard
from workbench.run.operators.quiet import QuietOperator
from workbench.run.operators.terminal import Show, TerminalOperator

if not TYPE_CHECKING:  # a type checker reads the imports
    __getattr__, __dir__, __all__ = exports(__name__)
