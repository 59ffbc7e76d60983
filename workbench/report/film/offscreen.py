"""A graphics context without a window, by whichever driver this computer has."""

from __future__ import annotations

import importlib
import os
import sys
from typing import Any, Self

import mujoco
import numpy as np
from numpy.typing import NDArray

from workbench.errors import WorkbenchError

__all__ = ["Offscreen"]

_MODULES = {"egl": "mujoco.egl", "osmesa": "mujoco.osmesa", "glfw": "mujoco.glfw"}
_ADVICE = {
    "linux": "install a software driver (on Debian: libegl1 libgl1-mesa-dri libopengl0), or set "
    "MUJOCO_GL to egl, osmesa or glfw",
    "darwin": "run it in a session with a screen",
    "win32": "install the driver of the graphics card, or run it in a session with a screen",
}


class Offscreen:
    """Renders scenes of a model; use it in a `with` block.

    Args:
        model: whose offscreen buffer is at least as large as the picture.
        width: of the picture [px].
        height: of the picture [px].

    Raises:
        WorkbenchError: when no driver here renders without a window.
    """

    def __init__(self, model: mujoco.MjModel, width: int, height: int) -> None:
        """Note what is rendered; the driver is asked when the block begins."""
        self._model, self._size = model, (width, height)

    def __enter__(self) -> Self:
        """Open the graphics context."""
        self._window = _window(*self._size)
        self._window.make_current()
        self._context = mujoco.MjrContext(self._model, mujoco.mjtFontScale.mjFONTSCALE_100.value)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN.value, self._context)
        return self

    def __exit__(self, *_: object) -> None:
        """Free the graphics context."""
        self._context.free()
        self._window.free()

    def render(
        self, scene: mujoco.MjvScene, size: tuple[int, int] | None = None
    ) -> NDArray[np.uint8]:
        """Return the scene as a picture, (height, width, 3); of a smaller size where one is given.

        Args:
            scene: whose camera has the sides of the picture.
            size: width and height [px], of at most those of the buffer.
        """
        width, height = size or self._size
        rect = mujoco.MjrRect(0, 0, width, height)
        pixels = np.empty((height, width, 3), np.uint8)
        mujoco.mjr_render(rect, scene, self._context)
        mujoco.mjr_readPixels(pixels, None, rect, self._context)
        return pixels[::-1]  # OpenGL counts rows from below


def _window(width: int, height: int) -> Any:
    """Return the context of the first driver that gives one."""
    said: list[str] = []
    for name in _drivers():
        try:
            return importlib.import_module(name).GLContext(width, height)
        except Exception as error:  # each driver has errors of its own, some are plain ones
            said.append(f"{name}: {str(error).splitlines()[0] if str(error) else repr(error)}")
    raise WorkbenchError(
        f"nothing can be rendered here without a window; {_ADVICE.get(sys.platform, '')}. "
        f"Tried: {'; '.join(said)}"
    )


def _drivers() -> list[str]:
    """Return the modules to try, in order; `MUJOCO_GL` decides where it names one."""
    asked = os.environ.get("MUJOCO_GL", "").lower()
    if asked in _MODULES:
        return [_MODULES[asked]]
    if sys.platform == "darwin":
        return ["mujoco.cgl"]
    return [_MODULES["glfw"]] if sys.platform == "win32" else ["mujoco.egl", "mujoco.osmesa"]
