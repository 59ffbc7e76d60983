"""Make the pictures of the documentation from a run's bundle.

    python docs/make_pictures.py RUN_FOLDER OUT

Writes `recording.png`, the viewer's whole window 8 s into the run, and `report.png`, the top of the
report as a browser shows it. Needs a Vulkan driver and chromium.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import tempfile
import time
from pathlib import Path

from PIL import Image

from workbench.errors import WorkbenchError
from workbench.review import HeadlessViewer

MOMENT_S = 8.0
SETTLE_S = 6.0  # the viewer's notices of its first seconds are gone by then
BROWSERS = ("chromium", "chromium-browser", "google-chrome")


def main() -> None:
    parser = argparse.ArgumentParser(description="Make recording.png and report.png of a run.")
    parser.add_argument("run", type=Path, help="bundle folder with compare.rrd and report.html")
    parser.add_argument("out", type=Path, help="folder for the pictures")
    asked = parser.parse_args()
    asked.out.mkdir(parents=True, exist_ok=True)
    picture_recording(asked.run / "compare.rrd", asked.out / "recording.png")
    picture_report(asked.run / "report.html", asked.out / "report.png")


def picture_recording(recording: Path, png: Path) -> None:
    with HeadlessViewer(width=1600, height=1000) as viewer:
        viewer.open(recording)
        viewer.set_time(MOMENT_S)
        time.sleep(SETTLE_S)
        viewer.screenshot(png)
    shrink(png)


def picture_report(report: Path, png: Path) -> None:
    with tempfile.TemporaryDirectory() as profile:
        command = [browser(), "--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars"]
        command += [f"--user-data-dir={profile}", "--window-size=900,1500"]
        command += [f"--screenshot={png.resolve()}", report.resolve().as_uri()]
        subprocess.run(command, check=True, timeout=120, capture_output=True)
    shrink(png)


def browser() -> str:
    found = [name for name in BROWSERS if shutil.which(name)]
    if not found:
        raise WorkbenchError(f"no browser for report.png; install one of {', '.join(BROWSERS)}")
    return found[0]


def shrink(png: Path) -> None:
    """Write the picture again without transparency and as small as it gets."""
    with Image.open(png) as picture:
        picture.convert("RGB").save(png, optimize=True)


if __name__ == "__main__":
    main()
