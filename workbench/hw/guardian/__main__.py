"""Start a guardian; only its client does that, see `process.py`."""

from __future__ import annotations

import sys

from workbench.hw.guardian.service import main

__all__: list[str] = []

sys.exit(main())
