"""`workbench run`: a protocol on a bench."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING, Annotated, Any

import typer

from workbench.cli.completion import bench_names, protocol_files, run_names
from workbench.cli.console import comparison_table, print_judgements, progress, show_table, stderr
from workbench.cli.plain_output import JsonFlag, RunsFolder, emit
from workbench.errors import InputError
from workbench.quantities import QUANTITIES, leading

if TYPE_CHECKING:
    from workbench.bundle import Bundle, Judgement
    from workbench.run import Bench

__all__ = ["run"]


def run(
    protocol: Annotated[Path, typer.Argument(help="Protocol file.", autocompletion=protocol_files)],
    bench: Annotated[
        str, typer.Option(help="Bench file, or `virtual`.", autocompletion=bench_names)
    ] = "virtual",
    dry_run: Annotated[
        bool, typer.Option(help="Rehearse on a simulated supply and print every step.")
    ] = False,
    registers: Annotated[
        bool, typer.Option("--registers", help="With --dry-run: also what the supply is written.")
    ] = False,
    plan_id: Annotated[
        str | None,
        typer.Option(
            help="Of a dry run, in its --json: refuse to run if a file has changed since."
        ),
    ] = None,
    resume: Annotated[
        Path | None,
        typer.Option(
            help="The experiment that was cut off, by any of its runs; goes on with it.",
            autocompletion=run_names,
        ),
    ] = None,
    pause: Annotated[
        bool, typer.Option("--pause", help="Ask after each run: go on, skip, repeat or end.")
    ] = False,
    watch: Annotated[
        bool, typer.Option("--watch", help="Draw robot, live twin and missing force meanwhile.")
    ] = False,
    runs: RunsFolder = Path("runs"),
    as_json: JsonFlag = False,
) -> None:
    """Carry out a protocol: drive, track, simulate the twin, compare.

    After each run its export is awaited in the folder `tracking.takes` of the bench file: it is
    taken when it is whole and belongs to this run. Ctrl-C then asks for a path instead; Ctrl-C
    again ends, with the output off, and `workbench ingest TAKE --into RUN` adds the take later.

    An experiment that was cut off goes on with `--resume` and any of its runs: what is complete is
    skipped, the run that broke off is repeated, and its bundle stays. With `--dry-run` that is
    only printed.

    Where the cameras stream (`live` of the bench file), each driven run is observed while it goes
    on: the panel shows the prediction error, `--watch` opens a window with robot and twin, and a
    run with `stop_when:` ends by itself, with exit code 4.

    A run whose result is outside of what the protocol expects (`expect:`) fails: exit code 1.

    Example: workbench run protocols/hop-17.yaml --bench virtual

    Example: workbench run protocols/clamped-sweep.yaml --dry-run
    """
    from workbench.run import (  # none of these for --help
        foresee,
        load_bench,
        make_bench,
        read_experiment,
    )
    from workbench.run import resume as go_on

    lab = load_bench(bench)
    device = make_bench(lab.content)
    experiment = read_experiment(protocol, lab, device.voltage_step)
    for warning in experiment.plan.warnings:
        stderr.print(f"warning: {warning}", markup=False)
    if plan_id not in (None, experiment.digest):
        raise InputError(
            f"{protocol}: protocol, bench, model or shape changed since the dry run that was "
            "confirmed; nothing was started. Look at the dry run again"
        )
    find = foresee if dry_run else go_on
    course = None if resume is None else find(resume, runs, experiment.inputs(), experiment.texts())
    if dry_run:
        from workbench.cli.dry_run import show_dry_run

        show_dry_run(experiment, as_json, course, registers)
        return
    if course is not None:
        runs = course.root or runs
        remaining = len(experiment.plan.without(course.done).runs)
        progress(
            f"experiment {course.id}: {len(course.done)} runs are complete, {remaining} are left"
        )
    from workbench.bundle import judgements, passed
    from workbench.cli.terminal import carry_out_at_terminal  # and all that a run needs
    from workbench.cli.views import bundle_json

    done: list[Bundle] = []
    failed = 0
    objects: list[dict[str, Any]] = []
    with _watching(device, watch):
        for bundle, undrawn in carry_out_at_terminal(experiment, device, runs, course, pause):
            done.append(bundle)
            objects.append(bundle_json(bundle, undrawn))
            judged = judgements(bundle.manifest)
            failed += passed(judged) is False
            if not as_json:
                _print_bundle(bundle, judged)
    if as_json:
        # a single run needs no list to be read
        emit((objects[0] if len(objects) == 1 else {}) | {"runs": objects})
    elif len(done) > 1:
        # the newest experiment of a protocol goes by its name; one that was resumed may be older
        _print_all(done, str(done[0].experiment) if resume else quote(protocol.stem))
    if failed:
        progress(f"{failed} of {len(done)} runs are not as the protocol expects")
        raise typer.Exit(1)


@contextmanager
def _watching(bench: Bench, wanted: bool) -> Iterator[None]:
    """Draw the live twins of a bench while the block lasts, if that is wanted.

    Raises:
        InputError: when its cameras do not stream.
        WorkbenchError: when there is no display for a window.
    """
    if not wanted:
        yield
        return
    if not bench.streams:
        raise InputError(
            f"--watch needs cameras that stream, and bench {bench.file.name!r} has no "
            "`tracking: live:`; name the stream there, or leave --watch out"
        )
    from workbench.report import LiveViewer

    with LiveViewer() as viewer:
        bench.viewer = viewer.port
        yield


def _print_all(done: Sequence[Bundle], name: str) -> None:
    """Print a row for each run, with the first number of robot and twin; `name` shows them all."""
    rows = []
    for bundle in done:
        compared = bundle.compared
        pair = (leading(one.model_dump()) for one in (compared.real, compared.twin))
        asked = bundle.path.name.split("_", 2)[-1]
        rows.append([str(bundle.asked.number), asked, *pair, f"{compared.error_mm:.1f}"])
    shown = (
        next(key for key in QUANTITIES if key in one.compared.real.model_dump()) for one in done
    )
    names = " or ".join(dict.fromkeys(QUANTITIES[key].spoken for key in shown))
    title = f"{done[0].asked.title}: {names} of robot and twin"
    show_table(title, ["run", "asked", "real", "twin", "error [mm]"], rows)
    print(f"all runs:  workbench review {name}")


def _print_bundle(bundle: Bundle, judged: Sequence[Judgement]) -> None:
    comparison_table(bundle.asked.title, bundle.compared)
    print_judgements(judged)
    print(f"bundle:    {bundle.path}")
    if bundle.view("report").exists():
        print(f"report:    {bundle.view('report')}")
    print(f"recording: workbench review {bundle.path}")
