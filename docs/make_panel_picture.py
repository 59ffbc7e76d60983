"""Make the picture of the panel beside a run.

    python -m docs.make_panel_picture OUT

Writes `panel.png`: the page 7 s into a run on the practice bench. Needs chromium.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import threading
from pathlib import Path

from PIL import Image

from tests.panel.chromium import Page, browser
from workbench.panel import Panel, Protocols, Starter, Watcher

MOMENT_S = 7.0
STARTS_S = 90.0
MAIN = [sys.executable, "-c", "from workbench.cli import main; main()", "run"]
PROTOCOL = "protocols/hop-17.yaml"
BENCH = "docs/examples/practice-bench.yaml"


def main() -> None:
    parser = argparse.ArgumentParser(description="Make panel.png beside a run.")
    parser.add_argument("out", type=Path, help="folder for the picture")
    out = parser.parse_args().out
    out.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        runs = Path(folder) / "runs"
        subprocess.run([*MAIN, PROTOCOL, "--runs", str(runs)], check=True, capture_output=True)
        with Watcher(runs) as watcher, browser() as found:
            panel = Panel(watcher, Starter(Protocols(Path("protocols"), BENCH), runs))
            serving = threading.Thread(target=panel.serve)
            serving.start()
            picture(found.open(panel.url, height=1000), runs, out / "panel.png")
            panel.stop()
            serving.join()
    with Image.open(out / "panel.png") as picture_of:
        picture_of.convert("RGB").save(out / "panel.png", optimize=True)


def picture(page: Page, runs: Path, png: Path) -> None:
    """Start a run, answer its prompt, and take the picture while it drives."""
    command = [*MAIN, PROTOCOL, "--bench", BENCH, "--runs", str(runs)]
    with subprocess.Popen(command, stdin=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as run:
        page.wait_for("!document.querySelector('#prompt').hidden", STARTS_S)
        page.click("#prompt-send")
        page.wait_for(f"now().run > {MOMENT_S}", STARTS_S)
        page.picture(png)
        run.terminate()


if __name__ == "__main__":
    main()
