"""What this machine offers."""

from __future__ import annotations

import platform
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from . import _core

SOFTWARE = ("Cpu", "Other")
"""Types of adapters that are no hardware."""


@dataclass(frozen=True)
class Info:
    """The version, the CPU engine, every adapter, and which of them renders; `print` it.

    Attributes
    ----------
    version : str
    cpu : dict
        The CPU engine: name of the processor, type, backend, driver, lanes (the kind of vector
        instructions) and threads.
    adapters : list of dict
        Name, type, backend, driver, features and limits of each.
    device : dict or None
        What renders where no ``device=`` is given: the CPU engine, or an adapter with its limits
        and the features used. None where ``LIXEL_DEVICE`` or ``WGPU_ADAPTER_NAME`` names what
        there is not.
    problem : str or None
        Why there is none, and what to do.
    """

    version: str
    cpu: dict[str, Any]
    adapters: list[dict[str, Any]]
    device: dict[str, Any] | None
    problem: str | None

    def __str__(self) -> str:
        lines = [f"lixel {self.version}", "CPU engine", *_lines(self.cpu, "  ")]
        for adapter in self.adapters:
            lines.append("adapter")
            lines += _lines(adapter, "  ")
        if self.device is not None:
            lines += [f"in use: {self.device['name']} ({self.device['type']})"]
        if self.problem is not None:
            lines.append(f"no device: {self.problem}")
        return "\n".join(lines)


def info() -> Info:
    """The CPU engine, every adapter with its driver and limits, and which of them is in use.

    Never raises for want of a device: `Info.problem` then says what to install.

    Returns
    -------
    Info
    """
    device, problem = None, None
    try:
        device = _core.device()
    except (_core.DeviceError, ValueError) as error:
        problem = str(error)
    return Info(_core.__version__, _core.device("cpu"), _core.adapters(), device, problem)


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


def system() -> dict[str, str]:
    """The versions of lixel, Python and numpy, and the operating system."""
    return {
        "lixel": _core.__version__,
        "python": platform.python_version(),
        "numpy": np.__version__,
        "system": platform.platform(),
    }
