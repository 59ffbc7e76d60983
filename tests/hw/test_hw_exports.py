from __future__ import annotations

from types import ModuleType

import pytest

import workbench.hw
import workbench.hw.simulated


@pytest.mark.parametrize("room", [workbench.hw, workbench.hw.simulated], ids=lambda m: m.__name__)
def test_the_list_of_exports_is_true(room: ModuleType) -> None:
    public = {
        name
        for name, value in vars(room).items()
        if not name.startswith("_") and not isinstance(value, ModuleType)
    }
    public -= {"TYPE_CHECKING", "exports"}
    assert sorted(room.__all__) == sorted(public | set(room.__all__))
    assert [name for name in room.__all__ if not hasattr(room, name)] == []
