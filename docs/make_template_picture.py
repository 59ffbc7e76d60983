"""Make the picture of a template for the documentation.

    python docs/make_template_picture.py OUT

Writes `template.png`, the thesis' initial shape on A3 as poppler draws it. Needs pdftoppm.
"""

from __future__ import annotations

import argparse
import subprocess
import tempfile
from datetime import date
from pathlib import Path

from PIL import Image

from workbench.schemas import load_shape
from workbench.template import make_sheet, make_strip, paper_named, pdf_pages

THICKNESS_M = 0.002
DAY = date(2026, 11, 21)
DPI = 72
COLOURS = 32  # of the picture, so that it stays small


def main() -> None:
    parser = argparse.ArgumentParser(description="Make template.png.")
    parser.add_argument("out", type=Path, help="folder for the picture")
    out = parser.parse_args().out
    strip = make_strip(load_shape("thesis-initial", Path()), THICKNESS_M)
    pdf = pdf_pages(make_sheet(strip, paper_named("A3"), DAY))
    with tempfile.TemporaryDirectory() as folder:
        page = Path(folder) / "page"
        command = ["pdftoppm", "-r", str(DPI), "-png", "-singlefile", "-", str(page)]
        subprocess.run(command, input=pdf, check=True, timeout=60)
        out.mkdir(parents=True, exist_ok=True)
        with Image.open(page.with_suffix(".png")) as picture:
            small = picture.convert("RGB").quantize(COLOURS)
            small.save(out / "template.png", optimize=True)


if __name__ == "__main__":
    main()
