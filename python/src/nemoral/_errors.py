"""The exceptions of this package."""

from __future__ import annotations

import errno
import os
from typing import Sequence


class Error(Exception):
    """Something failed while running."""


class ConfigError(Error, ValueError):
    """A config or an argument is wrong; nothing was done.

    Attributes:
        key: the dotted key, or the argument's name; empty if it is not about a single one.
        value: the refused value as text, if there is one.
        allowed: what is allowed, in words, if that is known.
        nearest: the name that was probably meant, if a name is unknown and there is one like it.
        errors: all errors of a config, this one first; a single error has only itself.
    """

    def __init__(
        self,
        message: str,
        key: str = "",
        value: str | None = None,
        allowed: str | None = None,
        nearest: str | None = None,
        errors: Sequence["ConfigError"] = (),
    ) -> None:
        super().__init__(message)
        self.key = key
        self.value = value
        self.allowed = allowed
        self.nearest = nearest
        self.errors: list[ConfigError] = list(errors) or [self]

    def __reduce__(self) -> tuple[type[ConfigError], tuple[object, ...]]:
        others = self.errors if self.errors[0] is not self else []
        return (
            type(self),
            (str(self), self.key, self.value, self.allowed, self.nearest, others),
        )


class DatasetError(Error):
    """A data set is damaged, unfinished, another's, or in the way; the message says what to do."""


def _value(key: str, message: str) -> str | None:
    start = f"{key} = "
    if not message.startswith(start):
        return None
    return message[len(start) :].split(": ", 1)[0]


def _of_config(
    found: list[tuple[str | None, str, str, str | None]], more: int
) -> ConfigError:
    """The exception of a config's errors: of each what is allowed, its key, message, nearest."""
    errors = [
        ConfigError(message, key, _value(key, message), allowed, nearest)
        for allowed, key, message, nearest in found
    ]
    if len(errors) == 1 and not more:
        return errors[0]
    lines = [str(error) for error in errors]
    if more:
        lines.append(f"... and {more} more")
    first = errors[0]
    text = "\n".join(lines)
    return ConfigError(text, first.key, first.value, first.allowed, first.nearest, errors)


def _of_argument(
    key: str, message: str, value: str | None, allowed: str | None
) -> ConfigError:
    return ConfigError(message, key, value, allowed)


def _of_file(path: os.PathLike[str] | str, code: int | None, text: str) -> OSError:
    if code is None:
        return OSError(errno.EIO, text, os.fspath(path))
    return OSError(code, os.strerror(code), os.fspath(path))
