"""What this machine offers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from . import _core


@dataclass(frozen=True)
class Info:
    """The version, every adapter, and the device in use; `print` it.

    Attributes
    ----------
    version : str
    adapters : list of dict
        Name, type, backend, driver, features and limits of each.
    device : dict or None
        The adapter in use, its limits and the optional features used; None where there is none.
    problem : str or None
        Why there is none, and what to install.
    """

    version: str
    adapters: list[dict[str, Any]]
    device: dict[str, Any] | None
    problem: str | None

    def __str__(self) -> str:
        lines = [f"lixel {self.version}"]
        for adapter in self.adapters:
            lines.append("adapter")
            lines += _lines(adapter, "  ")
        if self.device is not None:
            lines.append("in use")
            lines += _lines(self.device, "  ")
        if self.problem is not None:
            lines.append(f"no device: {self.problem}")
        return "\n".join(lines)


def info() -> Info:
    """Every adapter, its driver and limits, and which features are used.

    Never raises for want of a device: `Info.problem` then says what to install.

    Returns
    -------
    Info
    """
    device, problem = None, None
    try:
        device = _core.device()
    except _core.DeviceError as error:
        problem = str(error)
    return Info(_core.__version__, _core.adapters(), device, problem)


def _lines(values: Mapping[str, Any], indent: str) -> list[str]:
    lines = []
    for name, value in values.items():
        if isinstance(value, Mapping):
            lines += [f"{indent}{name}", *_lines(value, indent + "  ")]
        elif isinstance(value, (list, tuple)):
            lines.append(f"{indent}{name}: {', '.join(map(str, value)) or '-'}")
        else:
            lines.append(f"{indent}{name}: {value}")
    return lines
