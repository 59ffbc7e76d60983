"""`python -m workbench.cli` is `workbench`; so the panel starts a run."""

from __future__ import annotations

from workbench.cli.app import main

__all__: list[str] = []

main()
