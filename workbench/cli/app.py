"""Collect the verbs, turn errors into exit codes."""

from __future__ import annotations

import errno
import signal
import sys
from types import FrameType

import typer
from rich.console import Console

from workbench.cli.calibrate import calibrate
from workbench.cli.diagnose import diagnose
from workbench.cli.doctor import doctor
from workbench.cli.everywhere import NoColorFlag, QuietFlag, VersionFlag, moved_to_front, obey
from workbench.cli.identify import identify
from workbench.cli.ingest import ingest
from workbench.cli.investigate import investigate
from workbench.cli.live import live
from workbench.cli.modes import modes
from workbench.cli.optimize import optimize
from workbench.cli.output import tell
from workbench.cli.resonances import resonances
from workbench.cli.review import review
from workbench.cli.run import run
from workbench.cli.runs import runs
from workbench.cli.schema import schema
from workbench.cli.simulate import simulate
from workbench.cli.supply import supply
from workbench.cli.template_photo import template
from workbench.cli.thesis import thesis
from workbench.errors import InputError, Interrupted, WorkbenchError, what_to_do

__all__ = ["app", "main"]

app = typer.Typer(
    name="workbench",
    help="Run the hopping robot, pair every run with its MuJoCo twin, show both side by side.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode="markdown",
    context_settings={"help_option_names": ["-h", "--help"]},
)
for verb in (
    run,
    ingest,
    live,
    calibrate,
    identify,
    resonances,
    diagnose,
    investigate,
    simulate,
    modes,
    optimize,
    thesis,
    review,
    schema,
    doctor,
):
    app.command()(verb)
app.add_typer(runs)
app.add_typer(supply)
app.add_typer(template)


@app.callback()
def _top(
    version: VersionFlag = False, quiet: QuietFlag = False, no_color: NoColorFlag = False
) -> None:
    """Run the hopping robot, pair every run with its MuJoCo twin, show both side by side."""
    obey(quiet, no_color)


def main() -> None:
    """Run the command line; exit codes are those of `workbench.errors`."""
    for name in ("SIGTERM", "SIGHUP", "SIGBREAK"):  # the last two on some systems only
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), _stop)
    try:
        _call(moved_to_front(sys.argv[1:]))
    except WorkbenchError as error:
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
    except KeyboardInterrupt:
        print("workbench: stopped; no supply was in use", file=sys.stderr)
        sys.exit(Interrupted.exit_code)


def _call(words: list[str]) -> None:
    """Call the verb; however it ends, the line of progress leaves the terminal."""
    try:
        app(args=words, prog_name="workbench")
    finally:
        tell.pause()


def _stop(number: int, frame: FrameType | None) -> None:
    """End on SIGTERM and when the terminal closes as on Ctrl-C: the output is switched off.

    It has a name, which Ctrl-C has not: where Ctrl-C asks, this still ends the program.
    """
    raise KeyboardInterrupt(signal.Signals(number).name)
