"""Which operator a bench has."""

from __future__ import annotations

from workbench.progress import Progress
from workbench.run.control import ControlServer
from workbench.run.operators.keyboard import Keyboard
from workbench.run.operators.quiet import QuietOperator
from workbench.run.operators.terminal import Show, TerminalOperator
from workbench.run.takes import Operator
from workbench.schemas import BenchFile

__all__ = ["operator_of"]


def operator_of(
    bench: BenchFile, server: ControlServer, show: Show, progress: Progress
) -> Operator:
    """Return who answers the prompts of a bench.

    On a virtual one nobody, unless it runs in real time: then it is there to practise.

    Args:
        bench: its file.
        server: shows the prompts elsewhere.
        show: puts a text before the person at the terminal.
        progress: receives the prompts that nobody answers.
    """
    if bench.virtual is None:
        return TerminalOperator(server, Keyboard(), show)
    if bench.virtual.real_time:
        return TerminalOperator(server, Keyboard(), show, needed=False)
    return QuietOperator(progress)
