"""Names of the files of a bundle."""

from __future__ import annotations

import re
from typing import Literal

__all__ = [
    "CHECKSUMS",
    "GUARDIAN",
    "JOURNAL",
    "MANIFEST",
    "NAMED",
    "REMARKS",
    "TAKE",
    "VIEWS",
    "WIRE",
    "View",
]

MANIFEST, CHECKSUMS, REMARKS = "manifest.json", "checksums.txt", "remarks.jsonl"
JOURNAL, WIRE, GUARDIAN = "journal.jsonl", "wire.log", "guardian.jsonl"
TAKE = "take"

View = Literal["recording", "report"]
VIEWS: dict[View, str] = {"recording": "compare.rrd", "report": "report.html"}
"""Drawn from the rest at any time, so no part of the seal."""

NAMED = re.compile(r"\d{4}-\d\d-\d\d_\d{6}_")
"""How the name of a bundle's folder begins: date and time of day."""
