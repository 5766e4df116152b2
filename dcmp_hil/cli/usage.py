"""A command line that was typed wrong: one sentence on standard error, with the name that was meant."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from typer.core import TyperGroup

from dcmp_hil.common.similar_names import did_you_mean
from dcmp_hil.errors import ConfigError

if TYPE_CHECKING:
    from typer.exceptions import TyperException

_COERCION_PREFIX = "Value error, "  # what pydantic writes before the words of an error


class Commands(TyperGroup):
    """The commands; an unknown one is answered with the one that resembles it."""

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """Return the command that the first argument names.

        Raises
        ------
        ConfigError
            If there is no such command.
        """
        name = args[0]
        if name.startswith("-") or self.get_command(ctx, name) is not None:
            return super().resolve_command(ctx, args)
        known = list(self.commands)
        meant = did_you_mean(name, known, f"The commands: {', '.join(known)}.")
        raise ConfigError(f'"{name}" is no command. {meant} `{ctx.command_path} --help` explains them.')


def sentence(error: TyperException) -> str:
    """Return what is wrong with a command line, the option that was meant, and where its help is."""
    context: Any = getattr(error, "ctx", None)
    text = " ".join(error.format_message().replace(_COERCION_PREFIX, "").split())
    option = getattr(error, "option_name", None)
    if context is None:
        return text
    if option is not None and hasattr(error, "possibilities"):
        known = [
            name for one in context.command.get_params(context) for name in one.opts if name.startswith("-")
        ]
        text = " ".join(filter(None, (f"No such option: {option}.", did_you_mean(option, known, shown=str))))
    return f"{text.rstrip('.?')}{'?' if text.endswith('?') else '.'} See `{context.command_path} --help`."
