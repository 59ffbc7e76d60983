"""Names of the files of a bundle."""

from __future__ import annotations

import re

__all__ = ["CHECKSUMS", "GUARDIAN", "JOURNAL", "MANIFEST", "NAMED", "REMARKS", "TAKE", "WIRE"]

MANIFEST, CHECKSUMS, REMARKS = "manifest.json", "checksums.txt", "remarks.jsonl"
JOURNAL, WIRE, GUARDIAN = "journal.jsonl", "wire.log", "guardian.jsonl"
TAKE = "take"

NAMED = re.compile(r"\d{4}-\d\d-\d\d_\d{6}_")
"""How the name of a bundle's folder begins: date and time of day."""
