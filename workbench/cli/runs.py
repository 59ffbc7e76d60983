"""`workbench runs`: find, judge, compare, check and export runs."""

from __future__ import annotations

import typer

from workbench.cli.lazy import Verb, lazy_group

__all__ = ["RUNS", "runs"]

RUNS = {
    "list": Verb(
        "runs_list",
        "List the runs, newest last: all of them, or those that fit every option.",
        "list_runs",
    ),
    "show": Verb(
        "runs_show", "Show one run: real against twin, its manifest and people's remarks."
    ),
    "diff": Verb(
        "runs_diff",
        "Show what two runs differ in: what was asked, protocol, model, shape, bench, results.",
    ),
    "verify": Verb(
        "runs_show",
        "Check every checksum; exit code 1 when a file is missing, changed or unknown.",
        "verify_runs",
    ),
    "export": Verb(
        "runs_export",
        "Pack runs with all that a colleague needs, and a README that says what each column is.",
        "export_runs",
    ),
    "tag": Verb("runs_remarks", "Give a run tags, by which it can be found again."),
    "note": Verb(
        "runs_remarks", "Write a note to a run; it stays with the bundle, with name and time."
    ),
    "good": Verb("runs_remarks", "Judge a run to be good."),
    "bad": Verb("runs_remarks", "Judge a run to be bad; say why with `workbench runs note`."),
    "rebuild": Verb(
        "runs_list",
        "Read every bundle anew into the index, which is only a cache of them.",
        "rebuild_index",
    ),
}
"""Every verb of `workbench runs`, in the order in which help lists them."""

runs = typer.Typer(
    name="runs",
    help="Find, judge, compare, check and export runs.",
    cls=lazy_group(RUNS),
    no_args_is_help=True,
)


@runs.callback()
def _top() -> None:
    """Find, judge, compare, check and export runs."""
