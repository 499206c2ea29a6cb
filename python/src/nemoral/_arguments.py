"""Checks of arguments."""

from __future__ import annotations

import functools
import json
import math
import operator
import os
from typing import Any, Iterable, Mapping, SupportsIndex, Union

import numpy as np
import numpy.typing as npt

from . import _native
from ._errors import ConfigError

Config = Union[str, "os.PathLike[str]", Mapping[str, Any], None]
"""A preset's name, the path of a TOML file, or a config as a dict."""

Layers = tuple[Union[str, None], Union[str, None], list[dict[str, Any]]]


def refuse(
    key: str, value: object, allowed: str, nearest: str | None = None
) -> ConfigError:
    """The error of a wrong argument, with the word that was probably meant."""
    text = _shown(value)
    message = f"{key} = {text}: must be {allowed}"
    if nearest is not None:
        message += f"; did you mean `{nearest}`?"
    return ConfigError(message, key, text, allowed, nearest)


def _shown(value: object) -> str:
    """A value as text that is not too long."""
    text = repr(value)
    return text if len(text) <= 80 else text[:80] + "..."


def nearest(word: str, words: Iterable[str]) -> str | None:
    """The one of some words that was probably meant by one that is not among them."""
    import difflib

    plain = {known.replace(".", "_").lower(): known for known in words}
    found = difflib.get_close_matches(word.replace(".", "_").lower(), plain, 1, 0.7)
    return plain[found[0]] if found else None


@functools.cache
def _sections() -> frozenset[str]:
    """The names of the config's first level."""
    return frozenset(json.loads(_native.json_schema())["properties"])


@functools.cache
def _keys() -> frozenset[str]:
    """The dotted names of all keys of the config."""
    found: set[str] = set()

    def walk(part: Any, path: str) -> None:
        for name, inner in part.get("properties", {}).items():
            found.add(path + name)
            walk(inner, f"{path}{name}.")

    walk(json.loads(_native.json_schema()), "")
    return frozenset(found)


def check_names(settings: Mapping[str, Any], keywords: Iterable[str] = ()) -> None:
    """Refuse a preset that there is not, and names that are neither keywords nor keys of the
    config."""
    for name in settings:
        if name.split(".")[0] in _sections():
            continue
        meant = nearest(name, [*keywords, *_keys()])
        message = f"{name}: is neither an argument nor a key of the config"
        if meant is not None:
            message += f"; did you mean `{meant}`?"
        raise ConfigError(message, name, _shown(settings[name]), None, meant)
    preset = settings.get("preset")
    if isinstance(preset, str):
        _check_preset(preset)


def _check_preset(preset: str) -> None:
    known = [name for name, _ in _native.presets()]
    if preset not in known:
        allowed = f"one of {', '.join(known)}"
        raise refuse("preset", preset, allowed, nearest(preset, known))


def layers(
    config: Config,
    seed: SupportsIndex | None,
    overrides: Mapping[str, Any],
    keywords: Iterable[str] = (),
) -> Layers:
    """The layers of a request: preset, file, and values of keys. `keywords` are the other arguments
    that a misspelled one may have been meant for."""
    check_names(overrides, keywords)
    preset: str | None = None
    file: str | None = None
    settings: list[dict[str, Any]] = []
    if config is None:
        pass
    elif isinstance(config, Mapping):
        given = {_text(key, "a key of the config"): config[key] for key in config}
        check_names(given)
        settings.append(given)
    elif isinstance(config, os.PathLike):
        file = os.fsdecode(config)
    elif isinstance(config, str):
        is_file = config.endswith(".toml") or os.sep in config
        preset, file = (None, config) if is_file else (config, None)
        if preset is not None:
            _check_preset(preset)
    else:
        raise refuse("config", config, "a preset's name, the path of a TOML file, or a dict")
    over: dict[str, Any] = dict(overrides)
    if seed is not None:
        over["seed"] = whole("seed", seed, 0, 2**63 - 1)
    settings.append(over)
    return preset, file, settings


def _text(value: object, what: str) -> str:
    if isinstance(value, str):
        return value
    raise refuse(what, value, "text")


def text(key: str, value: object) -> str:
    """Text."""
    return _text(value, key)


def flag(key: str, value: object) -> bool:
    """A truth value."""
    if isinstance(value, (bool, np.bool_)):
        return bool(value)
    raise refuse(key, value, "True or False")


def whole(key: str, value: object, low: int, high: int) -> int:
    """A whole number within limits."""
    try:
        number = operator.index(value)  # type: ignore[arg-type]
    except TypeError:
        raise refuse(key, value, f"a whole number from {low} to {high}") from None
    if isinstance(value, (bool, np.bool_)) or not low <= number <= high:
        raise refuse(key, value, f"a whole number from {low} to {high}")
    return number


def real(key: str, value: object, low: float = -math.inf, high: float = math.inf) -> float:
    """A number within limits; infinities only where they are limits of a range that is not open."""
    allowed = "a finite number" if low == -math.inf else f"a number from {low:g} to {high:g}"
    if isinstance(value, (str, bytes, bool)):
        raise refuse(key, value, allowed)
    try:
        number = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError, OverflowError):
        raise refuse(key, value, allowed) from None
    if math.isnan(number) or not low <= number <= high:
        raise refuse(key, value, allowed)
    if math.isinf(number) and low == -math.inf:
        raise refuse(key, value, allowed)
    return number


def path(key: str, value: object) -> str:
    """The path of a file or folder."""
    if isinstance(value, (str, os.PathLike)):
        found = os.fspath(value)
        if isinstance(found, str) and found and "\0" not in found:
            return found
    raise refuse(key, value, "a path")


def array(
    key: str, value: object, dtype: npt.DTypeLike, shape: tuple[int | None, ...]
) -> npt.NDArray[Any]:
    """An array of a shape, in which None is any length, without copying one that is right."""
    words = "x".join("N" if n is None else str(n) for n in shape)
    allowed = f"numbers of the shape {words}"
    wanted: np.dtype[Any] = np.dtype(dtype)
    try:
        found = np.asarray(value)
        if found.size == 0 and found.dtype == np.float64:
            found = found.astype(wanted)
        if found.dtype.kind not in "biuf":
            raise refuse(key, value, allowed)
        if wanted.kind in "iu" and found.dtype != wanted:
            if found.dtype.kind not in "iu":
                raise refuse(key, value, f"whole {allowed}")
            limits = np.iinfo(wanted)
            if found.size and (found.min() < limits.min or found.max() > limits.max):
                raise refuse(key, value, f"{allowed} from {limits.min} to {limits.max}")
        with np.errstate(over="ignore"):
            made: npt.NDArray[Any] = np.ascontiguousarray(found, dtype=wanted)
    except (TypeError, ValueError, OverflowError) as error:
        if isinstance(error, ConfigError):
            raise
        raise refuse(key, value, allowed) from None
    if len(shape) == made.ndim + 1 and shape[0] is None:
        made = made[np.newaxis]
    fits = made.ndim == len(shape) and all(
        asked is None or asked == found for asked, found in zip(shape, made.shape)
    )
    if not fits:
        raise ConfigError(
            f"{key}: has the shape {made.shape}: must be {allowed}", key, str(made.shape), allowed
        )
    return made


def index(key: str, value: SupportsIndex) -> int:
    """A whole number, of which a frame or sequence may exist or not."""
    if isinstance(value, slice):
        raise refuse(key, value, "a whole number; several are [x[i] for i in range(...)]")
    try:
        found = operator.index(value)
    except TypeError:
        raise refuse(key, value, "a whole number") from None
    if isinstance(value, (bool, np.bool_)):
        raise refuse(key, value, "a whole number")
    return found


def exists(key: str, what: str, value: SupportsIndex, count: int, more: str) -> int:
    """The number of a frame or sequence, of which there are so many. `more` is the key of the
    config by which there are more.

    Raises:
        IndexError: if there is no such thing.
        ConfigError: if this is no whole number.
    """
    found = index(key, value)
    if 0 <= found < count:
        return found
    enough = f"; {more}={found + 1} in the config makes more" if found >= count else ""
    raise IndexError(f"{what} {found}: {_there_are(count, what)}{enough}")


def item(value: SupportsIndex, count: int) -> int:
    """The place in a row of so many frames; negative numbers count from its end.

    Raises:
        IndexError: if there is no such frame.
        ConfigError: if this is no whole number. Slices are none.
    """
    found = index("i", value)
    if -count <= found < count:
        return found % count
    raise IndexError(f"frame {found}: {_there_are(count, 'frame')}")


def _there_are(count: int, what: str) -> str:
    return f"there is 1 {what}" if count == 1 else f"there are {count} {what}s"


def keep(cache: object) -> str | None:
    """The folder of grown plants: the user's own for True, none for False."""
    if cache is True:
        return ""
    if cache is False or cache is None:
        return None
    return path("cache", cache)


PROGRAM: str = _native.__file__
"""The file of the compiled part."""
