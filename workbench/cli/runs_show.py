"""`workbench runs show`, `verify`: one run in detail, and the checksums of runs."""

from __future__ import annotations

from pathlib import Path

import typer

from workbench.bundle import Bundle, read_remarks, run_named, runs_named, verify
from workbench.cli.console import comparison_table, fact_rows, show_table
from workbench.cli.plain_output import (
    JsonFlag,
    RunArgument,
    RunArguments,
    RunsFolder,
    emit,
    print_to_stderr,
)

__all__ = ["show", "verify_runs"]

_LABELS = {
    "commanded_mm": "error_as_commanded_mm",
    "measured_input_mm": "error,_rotor_as_measured_mm",
    "measured_start_mm": "error,_start_too_mm",
    "noise_floor_mm": "error_by_noise_alone_mm",
    "compared_s": "errors_over_the_first_s",
}
"""Keys of the manifest whose names need their context -> labels that do not."""


def show(run: RunArgument, folder: RunsFolder = Path("runs"), as_json: JsonFlag = False) -> None:
    """Show one run: real against twin, its manifest and people's remarks.

    Example: workbench runs show hop-16.99
    """
    bundle, lost = Bundle.recover(run_named(run, folder))
    if lost:
        print_to_stderr(f"damaged: {lost}; what can still be read is shown")
    remarks = read_remarks(bundle.path)
    if as_json:
        notes = [{"at": one.at, "who": one.who, "text": one.text} for one in remarks.notes]
        judged = {"verdict": remarks.verdict, "tags": remarks.tags, "notes": notes}
        emit(bundle.manifest.flat() | {"bundle": str(bundle.path)} | judged)
        return
    if bundle.manifest.compared is not None:
        comparison_table(bundle.asked.title, bundle.manifest.compared)
    flat = bundle.manifest.flat() | {"output_off": bundle.record.output_off}
    facts = {
        _LABELS.get(key, key): value
        for key, value in flat.items()
        if not isinstance(value, (dict, tuple))
    }
    rows = fact_rows(facts)
    rows += [("verdict", remarks.verdict), ("tags", " ".join(remarks.tags) or "-")]
    rows += [("note", f"{one.text} ({one.who}, {one.at})") for one in remarks.notes]
    show_table(bundle.path.name, ["", ""], rows)


def verify_runs(
    runs: RunArguments, folder: RunsFolder = Path("runs"), as_json: JsonFlag = False
) -> None:
    """Check every checksum; exit code 1 when a file is missing, changed or unknown.

    Example: workbench runs verify hop-16.99
    """
    folders = runs_named(runs, folder)
    problems = {str(one) if one in runs else one.name: verify(one) for one in folders}
    bad = any(problems.values())
    if as_json:
        emit({"ok": not bad, "problems": problems})
    else:
        for path, faults in problems.items():
            print(f"{path}: {'ok' if not faults else ''}")
            for fault in faults:
                print(f"  {fault}")
    if bad:
        raise typer.Exit(1)
