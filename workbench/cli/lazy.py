"""Commands that are imported when they are called: a list of runs need not wait for MuJoCo."""

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
    """Return a class of command group that imports a command when it is called.

    Help and completion of the group itself use placeholders; those of a command use its own
    options.
    """

    class LazyGroup(TyperGroup):
        def __init__(self, **settings: Any) -> None:
            super().__init__(**settings)
            self.commands = {name: TyperCommand(name, help=v.help) for name, v in verbs.items()}

        def resolve_command(self, ctx: Any, args: list[str]) -> Any:
            name, placeholder, rest = super().resolve_command(ctx, args)
            if name is None or placeholder is None:
                return name, placeholder, rest
            return name, _imported(name, verbs[name]), rest

    return LazyGroup


def _imported(name: str, where: Verb) -> object:
    """Import a verb and return its command or group."""
    verb: typer.Typer | Callable[..., None]
    verb = getattr(import_module(f"workbench.cli.{where.module}"), where.function or name)
    parent = typer.Typer(rich_markup_mode="markdown", add_completion=False)
    parent.callback()(lambda: None)  # so that typer keeps a group of one command
    if isinstance(verb, typer.Typer):
        parent.add_typer(verb)
    else:
        parent.command(name)(verb)
    return typer.main.get_group(parent).commands[name]
