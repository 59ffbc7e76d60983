"""Verbs that are imported when they are called: a list of runs need not wait for MuJoCo."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any, NamedTuple

import typer
from typer.core import TyperCommand, TyperGroup

__all__ = ["Verb", "lazy_group"]


class Verb(NamedTuple):
    """Where a verb lives.

    Args:
        module: of `workbench.cli`.
        help: the first sentence of its help, so that a list of the verbs needs none of them.
        function: its name in the module, where that is not the verb's own.
    """

    module: str
    help: str
    function: str | None = None


def lazy_group(verbs: Mapping[str, Verb]) -> type[TyperGroup]:
    """Return a kind of group whose verbs are known by name, and imported when one is meant.

    Help and completion of the group itself show stand-ins; from the verb's name on everything,
    help and completion of its options too, is the verb's own.
    """

    class LazyGroup(TyperGroup):
        def __init__(self, **settings: Any) -> None:
            super().__init__(**settings)
            self.commands = {name: TyperCommand(name, help=v.help) for name, v in verbs.items()}

        def resolve_command(self, ctx: Any, args: list[str]) -> Any:
            name, stand_in, rest = super().resolve_command(ctx, args)
            if name is None or stand_in is None:
                return name, stand_in, rest
            return name, _imported(name, verbs[name]), rest

    return LazyGroup


def _imported(name: str, where: Verb) -> object:
    """Return the command or group that a verb is."""
    verb: typer.Typer | Callable[..., None]
    verb = getattr(import_module(f"workbench.cli.{where.module}"), where.function or name)
    alone = typer.Typer(rich_markup_mode="markdown", add_completion=False)
    alone.callback()(lambda: None)  # so that it stays a group, of this one
    if isinstance(verb, typer.Typer):
        alone.add_typer(verb)
    else:
        alone.command(name)(verb)
    group = typer.main.get_group(alone)
    return group.commands[name]
