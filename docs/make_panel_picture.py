"""Make the pictures of the panel: before a run, and beside it.

    python -m docs.make_panel_picture OUT

Writes `panel-start.png`, the dry run that is confirmed, and `panel.png`, 7 s into that run on the
practice bench. Needs chromium.
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
        starter = Starter(Protocols(Path("protocols"), BENCH), runs)
        with Watcher(runs, starter.facts_of) as watcher, browser() as found:
            panel = Panel(watcher, starter)
            serving = threading.Thread(target=panel.serve)
            serving.start()
            pictures(found.open(panel.url), out)
            starter.close()
            panel.stop()
            serving.join()
    for name in ("panel-start.png", "panel.png"):
        with Image.open(out / name) as picture:
            picture.convert("RGB").save(out / name, optimize=True)


def pictures(page: Page, out: Path) -> None:
    """Start a run, answer its prompt, and take the pictures before and while it drives."""
    name = f"[data-name='{Path(PROTOCOL).name}']"
    page.wait_for(f'document.querySelector("{name}") !== null', STARTS_S)
    page.click(name)
    page.wait_for("!document.querySelector('#plan-shown').hidden", STARTS_S)
    page.click("#operator")
    page.type("Ada")
    page.resize(1280, 760)
    page.picture(out / "panel-start.png")
    page.resize(1280, 1000)
    page.click("#confirm-start")
    page.wait_for("!document.querySelector('#prompt').hidden", STARTS_S)
    page.click("#prompt-send")
    page.wait_for(f"now().run > {MOMENT_S}", STARTS_S)
    page.picture(out / "panel.png")


if __name__ == "__main__":
    main()
