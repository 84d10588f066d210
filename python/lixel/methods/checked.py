"""Classes whose fields are parameters that the core declares and checks."""

from __future__ import annotations

from dataclasses import fields
from typing import Any, ClassVar

from .. import _core
from ..arguments import did_you_mean


class Checked:
    """Parameters in the fields of a frozen dataclass, checked by the rules that the core declares.

    The class has the fields' types and their meaning; tests hold them to `lixel._core.parameters`.
    """

    name: ClassVar[str]

    def __new__(cls, *_: Any, **given: Any) -> Any:
        known = [field.name for field in fields(cls)]  # type: ignore[arg-type]
        for name in given:
            if name not in known:
                raise TypeError(
                    f"parameter of {cls.__name__} must be one of {', '.join(known) or 'none'}, "
                    f"got {name!r}{did_you_mean(name, known)}"
                )
        return super().__new__(cls)

    def __post_init__(self) -> None:
        try:
            checked = _core.check_parameters(self.name, self.parameters())
        except ValueError as error:
            raise ValueError(f"{error}{self._nearest_choice(str(error))}") from None
        for name, value in checked.items():
            object.__setattr__(self, name, value)

    def _nearest_choice(self, error: str) -> str:
        """For the end of the core's message: the choice that is nearest to what was given."""
        for rule in _core.parameters(self.name):
            value = getattr(self, rule["name"])
            if error.startswith(f"{rule['name']} must ") and isinstance(value, (str, list, tuple)):
                # One name, or a product of several.
                names = value.split("*") if isinstance(value, str) else value
                nearest = (did_you_mean(name, rule["choices"]) for name in names)
                return next(filter(None, nearest), "")
        return ""

    def parameters(self) -> dict[str, Any]:
        """Every parameter by name."""
        return dict(vars(self))
