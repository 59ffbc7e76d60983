"""Byte offsets of MuJoCo's arrays in mjModel and mjData, for compiled callbacks.

The layout comes from `mujoco.introspect`, which describes the installed headers, and is checked
against live objects before use.
"""

from __future__ import annotations

import ctypes
from typing import Any

import mujoco
import numpy as np
from mujoco.introspect import ast_nodes
from mujoco.introspect.enums import ENUMS
from mujoco.introspect.structs import STRUCTS
from numba import types  # pyright: ignore[reportPrivateImportUsage]
from numba.core import cgutils
from numba.extending import intrinsic

__all__ = ["as_pointer", "check_layout", "data_offset", "model_offset"]

_PLAIN = {
    "char": ctypes.c_char,
    "int": ctypes.c_int,
    "unsigned int": ctypes.c_uint,
    "float": ctypes.c_float,
    "double": ctypes.c_double,
    "mjtNum": ctypes.c_double,
    "mjtByte": ctypes.c_ubyte,
    "mjtBool": ctypes.c_bool,
    "mjtSize": ctypes.c_int64,
    "int64_t": ctypes.c_int64,
    "uint64_t": ctypes.c_uint64,
    "size_t": ctypes.c_size_t,
    "uintptr_t": ctypes.c_void_p,
}


def _ctype(node: object) -> Any:
    if isinstance(node, ast_nodes.PointerType):
        return ctypes.c_void_p
    if isinstance(node, ast_nodes.ArrayType):
        kind = _ctype(node.inner_type)
        for extent in reversed(node.extents):
            kind = kind * extent
        return kind
    if isinstance(node, ast_nodes.ValueType):
        return _named(node.name)
    base = ctypes.Union if isinstance(node, ast_nodes.AnonymousUnionDecl) else ctypes.Structure
    return _layout(base, node.fields)  # type: ignore[attr-defined]


def _named(name: str) -> Any:
    if name in _PLAIN:
        return _PLAIN[name]
    if name in ENUMS:
        return ctypes.c_int
    return _layout(ctypes.Structure, STRUCTS[name].fields)


def _layout(base: type, fields: tuple[Any, ...]) -> Any:
    return type("Layout", (base,), {"_fields_": [(f.name, _ctype(f.type)) for f in fields]})


_MODEL = _named("mjModel")
_DATA = _named("mjData")


def model_offset(field: str) -> int:
    """Return the byte offset of a size or of an array's pointer in mjModel."""
    return getattr(_MODEL, field).offset


def data_offset(field: str) -> int:
    """Return the byte offset of an array's pointer in mjData."""
    return getattr(_DATA, field).offset


def _typed(typing, address):  # numba's own calling form
    """Turn an address into a void pointer."""

    def generate(context, builder, signature, args):
        return builder.inttoptr(args[0], cgutils.voidptr_t)

    return types.voidptr(types.int64), generate


as_pointer: Any = intrinsic(_typed)
"""Turns an address, found at such an offset, into a void pointer; for compiled code only."""


def check_layout() -> None:
    """Compare the described layout with live objects.

    Raises:
        RuntimeError: when this MuJoCo build lays its structs out otherwise.
    """
    spec = mujoco.MjSpec()
    spec.nuserdata = 3
    spec.worldbody.add_body().add_freejoint()
    spec.bodies[1].mass, spec.bodies[1].inertia = 1.0, np.ones(3)
    spec.bodies[1].explicitinertial = True
    spec.add_numeric(name="probe", data=[1.0, 2.0])
    model = spec.compile()
    data = mujoco.MjData(model)
    found = [
        (model, name, model_offset) for name in ("numeric_data", "jnt_stiffness", "qpos_spring")
    ] + [
        (data, name, data_offset)
        for name in (
            *("qpos", "qvel", "qfrc_passive", "userdata"),
            *("xpos", "subtree_com", "cdof", "cvel"),
        )
    ]
    for name in ("nv", "nbody", "nnumericdata"):
        size = ctypes.c_int64.from_address(model._address + model_offset(name)).value
        if size != getattr(model, name):
            raise _wrong_layout(name)
    for owner, name, offset in found:
        pointer = ctypes.c_void_p.from_address(owner._address + offset(name)).value
        if pointer != getattr(owner, name).ctypes.data:
            raise _wrong_layout(name)


def _wrong_layout(name: str) -> RuntimeError:
    return RuntimeError(
        f"MuJoCo {mujoco.__version__}: {name} is not where mujoco.introspect puts it; "
        "ground and force laws cannot run on this build"
    )
