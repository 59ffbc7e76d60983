# MuJoCo's compiled modules carry no types; this lets its names pass as Any.
from typing import Any

def __getattr__(name: str) -> Any: ...
