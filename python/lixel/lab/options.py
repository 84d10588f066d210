"""Texts of the commands' options as values."""

from __future__ import annotations

import argparse
import ast
from collections.abc import Sequence
from dataclasses import fields, replace
from typing import Any

from ..methods import Method, method_from


def image_size(text: str) -> tuple[int, int]:
    """Pixels, (width, height)."""
    width, separator, height = text.lower().partition("x")
    if not (separator and width.isdecimal() and height.isdecimal()):
        raise argparse.ArgumentTypeError(f"must be WIDTHxHEIGHT in pixels, got {text!r}")
    return int(width), int(height)


def parameter(text: str) -> tuple[str, Any]:
    """A parameter's name and value."""
    name, separator, value = text.partition("=")
    if not (separator and name):
        raise argparse.ArgumentTypeError(f"must be NAME=VALUE, got {text!r}")
    try:
        return name, ast.literal_eval(value)
    except (ValueError, SyntaxError):
        return name, value  # no Python literal: a string


def method_with(name: str, resolution: int | None, parameters: Sequence[tuple[str, Any]]) -> Method:
    """The method of a name, with parameters; the resolution, where one is given, is one more."""
    method = method_from(name)
    values = dict(parameters)
    if resolution is not None:
        values["resolution"] = resolution
    known = [f.name for f in fields(method)]
    for key in values:
        if key not in known:
            raise ValueError(f"parameter of {name} must be one of {', '.join(known)}, got {key!r}")
    return replace(method, **values)
