"""Make the picture of the report for the documentation from a run's bundle.

    python docs/make_pictures.py RUN_FOLDER OUT

Writes `report.png`, the top of the report as a browser shows it. Needs chromium. The pictures of
the viewer are made by `tests/report/test_review_bar.py`.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import tempfile
from pathlib import Path

from PIL import Image

from workbench.errors import WorkbenchError

BROWSERS = ("chromium", "chromium-browser", "google-chrome")


def main() -> None:
    parser = argparse.ArgumentParser(description="Make report.png of a run.")
    parser.add_argument("run", type=Path, help="bundle folder with report.html")
    parser.add_argument("out", type=Path, help="folder for the picture")
    asked = parser.parse_args()
    asked.out.mkdir(parents=True, exist_ok=True)
    picture_report(asked.run / "report.html", asked.out / "report.png")


def picture_report(report: Path, png: Path) -> None:
    with tempfile.TemporaryDirectory() as profile:
        command = [browser(), "--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars"]
        command += [f"--user-data-dir={profile}", "--window-size=900,1500"]
        command += [f"--screenshot={png.resolve()}", report.resolve().as_uri()]
        subprocess.run(command, check=True, timeout=120, capture_output=True)
    with Image.open(png) as picture:
        picture.convert("RGB").save(png, optimize=True)


def browser() -> str:
    found = [name for name in BROWSERS if shutil.which(name)]
    if not found:
        raise WorkbenchError(f"no browser for report.png; install one of {', '.join(BROWSERS)}")
    return found[0]


if __name__ == "__main__":
    main()
