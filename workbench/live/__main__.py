"""Run the worker: `python -m workbench.live`, started by `LiveTwin` alone."""

from __future__ import annotations

from workbench.live.worker import main

__all__: list[str] = []

if __name__ == "__main__":
    main()
