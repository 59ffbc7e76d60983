"""The cleaning recipes by name. A new recipe is one file and one entry here."""

from __future__ import annotations

from workbench.errors import InputError, did_you_mean
from workbench.tracking.default_recipe import default
from workbench.tracking.recipe import Recipe
from workbench.tracking.thesis_recipe import thesis

__all__ = ["CLEANING", "recipe_named"]

CLEANING: dict[str, Recipe] = {"default": default, "thesis": thesis}


def recipe_named(name: str) -> Recipe:
    """Return a recipe.

    Raises:
        InputError: there is none of that name.
    """
    if name not in CLEANING:
        raise InputError(
            f"cleaning recipe {name!r} is unknown; there are {', '.join(CLEANING)}"
            f"{did_you_mean(name, CLEANING)}"
        )
    return CLEANING[name]
