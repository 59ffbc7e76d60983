"""Collect the verbs, turn errors into exit codes."""

from __future__ import annotations

import errno
import gc
import signal
import sys
from contextlib import suppress
from types import FrameType

import typer

from workbench.cli.global_options import (
    NoColorFlag,
    QuietFlag,
    VersionFlag,
    apply_options,
    options_first,
)
from workbench.cli.lazy import Verb, lazy_group
from workbench.errors import InputError, Interrupted, WorkbenchError, what_to_do
from workbench.output import ledgers

__all__ = ["VERBS", "app", "main", "pending_interruption"]

VERBS = {
    "run": Verb("run", "Carry out a protocol: drive, track, simulate the twin, compare."),
    "ingest": Verb(
        "ingest",
        "Make bundles of a sheet's takes, report what an export holds, or add it to a run.",
    ),
    "live": Verb(
        "live",
        "Record Motive's NatNet stream, report what came, and write it as an export with --out.",
    ),
    "calibrate": Verb(
        "calibrate",
        "Fit the line from voltage to rotor speed, with intervals and checks of linearity.",
    ),
    "identify": Verb(
        "identify",
        "Fit stiffness and damping, or what --fit names, to runs; validate on those held out.",
    ),
    "resonances": Verb(
        "resonances", "Report the resonances of a clamped sweep and the damping of ring-downs."
    ),
    "diagnose": Verb(
        "diagnose",
        "Find what the simulation gets wrong in runs, name the cause, write the extended model.",
    ),
    "investigate": Verb(
        "investigate",
        "Run, diagnose, propose, run, until one cause remains, or none, or time is up.",
    ),
    "simulate": Verb(
        "simulate",
        "Simulate one run and report how far it went, how it rang, and whether the robot fell.",
    ),
    "modes": Verb(
        "modes",
        "Report the natural modes of the clamped robot, and with --driven the peaks when driven.",
    ),
    "optimize": Verb(
        "optimize", "Search for a beam that hops farther, or is better in another way."
    ),
    "thesis": Verb(
        "thesis", "Do an experiment of the thesis again and print it beside the thesis' numbers."
    ),
    "panel": Verb(
        "panel",
        "Serve a page that starts runs of a folder of protocols, shows, answers and stops them.",
    ),
    "review": Verb(
        "review",
        "Show robots beside their twins, and the twin of an extended model where there is one.",
    ),
    "schema": Verb("schema", "Print the JSON Schema of a file."),
    "doctor": Verb(
        "doctor",
        "Check packages, viewer, ports and who may open them, disk and clocks; change nothing.",
    ),
    "runs": Verb("runs", "Find, judge, compare, check and export runs."),
    "supply": Verb("supply", "The motor's supply by hand."),
    "template": Verb(
        "template_photo",
        "Draw a shape at 1:1 to bend the strip against: `workbench template SHAPE` is short for "
        "`workbench template draw SHAPE`.",
    ),
}
"""Every verb, in the order in which help lists them."""

app = typer.Typer(
    name="workbench",
    help="Run the hopping robot, pair every run with its MuJoCo twin, show both side by side.",
    cls=lazy_group(VERBS),
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode="markdown",
    context_settings={"help_option_names": ["-h", "--help"]},
)


@app.callback()
def _top(
    version: VersionFlag = False, quiet: QuietFlag = False, no_color: NoColorFlag = False
) -> None:
    """Run the hopping robot, pair every run with its MuJoCo twin, show both side by side."""
    apply_options(quiet, no_color)


def main() -> None:
    """Run the command line; exit codes are those of `workbench.errors`."""
    # Objects of a command live until it ends: a garbage collection every 700 new objects, Python's
    # default, takes a tenth of `workbench run`.
    gc.set_threshold(10_000)
    for name in ("SIGTERM", "SIGHUP", "SIGBREAK"):  # the last two on some systems only
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), _stop)
    _report_live_outputs()
    try:
        _call(options_first(sys.argv[1:]))
    except WorkbenchError as error:
        if isinstance(error, Interrupted):  # another one would only hide this message
            signal.signal(signal.SIGINT, signal.SIG_IGN)
        from rich.console import Console  # only now: most commands print no error

        Console(stderr=True, highlight=False, soft_wrap=True, markup=False).print(
            f"workbench: {error}", style="red" if sys.stderr.isatty() else ""
        )
        sys.exit(error.exit_code)
    except OSError as error:
        if error.filename is None and error.errno != errno.ENOSPC:
            raise  # no file that a user could do something about
        place = "" if error.filename is None else f"{error.filename}: "
        print(f"workbench: {place}{what_to_do(error)}", file=sys.stderr)
        sys.exit(InputError.exit_code)
    except KeyboardInterrupt as stop:
        message = pending_interruption(stop) or "stopped; no supply was in use"
        print(f"workbench: {message}", file=sys.stderr)
        sys.exit(Interrupted.exit_code)


def _report_live_outputs() -> None:
    """Report before anything else each output that may be on and that nobody watches."""
    with suppress(OSError):  # then its next run reports it
        for ledger in ledgers():
            latch = ledger.latch()
            if latch is not None and latch.output.live:
                state = f"{ledger.key} at {latch.address} is {latch.description}"
                off = "or by: workbench supply off --bench BENCH"
                print(f"workbench: {state}, {off}", file=sys.stderr)


def pending_interruption(stop: BaseException) -> Interrupted | None:
    """Return the message of a first Ctrl-C that a second one overtook on its way here."""
    while stop.__context__ is not None:
        stop = stop.__context__
        if isinstance(stop, Interrupted):
            return stop
    return None


def _call(words: list[str]) -> None:
    """Call the verb; however it ends, the line of progress leaves the terminal."""
    try:
        app(args=words, prog_name="workbench")
    finally:
        if output := sys.modules.get("workbench.cli.console"):  # else nothing was printed
            output.progress.pause()


def _stop(number: int, frame: FrameType | None) -> None:
    """End on SIGTERM and when the terminal closes as on Ctrl-C: the output is switched off.

    The exception carries the signal's name, Ctrl-C's does not: where Ctrl-C asks the operator, this
    still ends the program.
    """
    raise KeyboardInterrupt(signal.Signals(number).name)
