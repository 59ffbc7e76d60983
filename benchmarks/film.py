"""How long the film of a ten-second hop takes, beside the bar of a minute on two cores.

    python benchmarks/film.py [--quick] [--slow 4]

Both robots are in the picture, rendered as `workbench review RUN --video` does; in software where
there is no graphics card. Processor time stands beside the wall's, for a computer that does other
things meanwhile: divided by two it is what two idle cores need at least.
"""

from __future__ import annotations

import argparse
import os
import tempfile
import time
from dataclasses import replace
from pathlib import Path

from tests.report.conftest import make_comparison
from workbench.report import Film, write_video

QUICK_S = 1.0
BAR_S = 60.0
"""Wall time of a film of ten seconds on two idle cores."""


def main() -> None:
    """Film a run and print the table."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--quick", action="store_true", help=f"{QUICK_S:g} s of the run only")
    options.add_argument("--slow", type=float, default=1.0, help="how many times slower than life")
    given = options.parse_args()
    run = make_comparison()
    run = replace(run, estimate=run.twin, duration_s=QUICK_S if given.quick else run.duration_s)
    how = Film(slow=given.slow)
    frames = len(how.times(run))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "hop.mp4"
        wall, processor = time.perf_counter(), time.process_time()
        write_video(run, path, how, lambda text: None)
        wall, processor = time.perf_counter() - wall, time.process_time() - processor
        size = path.stat().st_size / 1e6
    bar = "" if given.quick else f"{BAR_S:.0f} s, {'met' if wall < BAR_S else 'MISSED'}"
    print(f"{how.width} x {how.height}, {frames / how.rate_hz:.1f} s of film, {size:.1f} MB")
    print(f"{'frames':>8} {'wall [s]':>9} {'processor [s]':>14} {'a frame [ms]':>13} {'bar':>12}")
    each = 1000 * processor / frames
    print(f"{frames:8} {wall:9.1f} {processor:14.1f} {each:13.0f} {bar:>12}")
    print(f"load of this computer, its {os.cpu_count()} cores: {os.getloadavg()[0]:.1f}")


if __name__ == "__main__":
    main()
