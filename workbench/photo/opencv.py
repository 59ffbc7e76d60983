"""The only door to OpenCV, which the extra `photo` brings."""

from __future__ import annotations

from types import ModuleType

from workbench.errors import InputError

__all__ = ["opencv"]


def opencv() -> ModuleType:
    """Return the library.

    Raises:
        InputError: when it is not installed, with what to do.
    """
    try:
        import cv2
    except ModuleNotFoundError:
        raise InputError(
            "photographs and their board need the package opencv-contrib-python-headless; "
            "pip install hopping-workbench[photo], or measure by hand: template read --angles "
            "or --points"
        ) from None
    return cv2
