"""Runs on a bench: from a protocol to sealed bundles, the output always off at the end.

`engine` carries a plan out. `experiment` is all files of one, `course` what of it is done and
`between` what is done after a run, `prompting` puts a prompt to whoever answers, `readiness`
refuses a full disk. `attended` is the same where the panel can see it: `control/` is the server in
the process of a run, `operators/` are those who answer, `takes/` waits for the export of the
cameras.

`bench` makes devices of a bench file, `bench_supply` its supply, and `virtual` is the laboratory in
place of the real one: the only file here that simulates. `by_hand` drives a supply without a
protocol, `rehearsal` a plan on a simulated supply. `ingest` makes bundles of what was measured
elsewhere; `started_by` says who did.

What does not live here: bytes to a device (`hw`), the twin (`twin`), anything that is drawn
(`report`). Names are loaded when they are used: the help of `workbench run` needs none of them.
"""

from typing import TYPE_CHECKING

from workbench.room_exports import exports

if TYPE_CHECKING:
    from workbench.run.attended import carry_out_with_control
    from workbench.run.bench import Bench, Operator, RealBench, load_bench, make_bench
    from workbench.run.by_hand import acknowledged, drive, opened, switch_off, who_is_at
    from workbench.run.control.client import answer, pause, press_stop, watch
    from workbench.run.control.server import ControlServer
    from workbench.run.control.session import SessionFile, holder, session_files
    from workbench.run.course import Course, foresee, resume
    from workbench.run.engine import carry_out
    from workbench.run.experiment import Experiment, read_experiment, require_takes
    from workbench.run.ingest import add_take, ingest_sheet
    from workbench.run.operators.choosing import operator_of
    from workbench.run.operators.quiet import QuietOperator
    from workbench.run.readiness import existing, free_gb
    from workbench.run.rehearsal import Rehearsed, rehearse
    from workbench.run.started_by import START, VARIABLE, operator_name

if not TYPE_CHECKING:  # a type checker reads the imports
    __getattr__, __dir__, __all__ = exports(__name__)
