"""Which operator a bench has."""

from __future__ import annotations

from workbench.control import ControlServer
from workbench.operators.keyboard import Keyboard
from workbench.operators.quiet import QuietOperator
from workbench.operators.terminal import Show, TerminalOperator
from workbench.progress import Progress
from workbench.protocol import BenchFile
from workbench.takes import Operator

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
