"""What surfaces are, finer than classes."""

from . import _native

SEMANTICS: tuple[str, ...] = tuple(_native.SEMANTICS)
"""The names of fine semantics, such as ``"stem"``: ``SEMANTICS[i]`` is what i means in
:attr:`nemoral.Points.fine_semantic`."""
