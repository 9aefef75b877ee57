"""Which port of a Verilog module is what: the pins file."""

from __future__ import annotations

import enum
import re
from collections.abc import Iterable
from dataclasses import dataclass, fields
from pathlib import Path

from rtec.checks import whole_within
from rtec.errors import ArgumentError, meant
from rtec.io import Section, read_toml

_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_$]{0,99}")
_OPTIONAL = ("reset", "refused")
_LINE, _TOTAL, _CODE = (1, 1), (2, 32), (1, 32)
_RULES = {
    "clock": (True, _LINE),
    "reset": (True, _LINE),
    "a_in": (True, _LINE),
    "b_in": (True, _LINE),
    "requested": (True, _TOTAL),
    "a_out": (False, _LINE),
    "b_out": (False, _LINE),
    "completed": (False, _TOTAL),
    "refused": (False, _CODE),
}
"""Of each port: whether it is an input, and its least and largest width in bits."""


class Active(enum.Enum):
    """The level at which a reset resets."""

    HIGH = "high"
    LOW = "low"


@dataclass(frozen=True, slots=True)
class Port:
    """A port of a module as the simulator knows it."""

    name: str
    is_input: bool
    bits: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Pins:
    """The ports that an insertion algorithm in Verilog works with.

    Raises
    ------
    ArgumentError
        A name that is none in Verilog, or one port for two things.

    Examples
    --------
    >>> pins = Pins(top="mine", clock="clk", a_in="a", b_in="b", requested="asked", a_out="qa", b_out="qb",
    ...             completed="done")
    >>> pins.reset is None, pins.outputs
    (True, ('qa', 'qb', 'done'))
    """

    top: str
    """The module."""
    clock: str
    """Input, one bit: it works at the rising edge, at the falling one, or at both."""
    a_in: str
    b_in: str
    """Inputs, one bit: the encoder. They know nothing of the clock."""
    requested: str
    """Input, a signed total of steps that are to have been inserted, 2 to 32 bits."""
    a_out: str
    b_out: str
    """Outputs, one bit: what the controller sees."""
    completed: str
    """Output, the signed total of steps that have been inserted, 2 to 32 bits."""
    refused: str | None = None
    """Output, 1 to 32 bits: 0, or the number of the reason why it refuses what is requested for good. Optional."""
    reset: str | None = None
    """Input, one bit. Optional."""
    reset_active: Active = Active.HIGH
    """The level at which it resets."""
    reset_ticks: int = 8
    """For how many ticks of the clock it does so at power-up."""
    where: str = "pins"
    """What error messages call all this: the file that it was read from."""

    def __post_init__(self) -> None:
        whole_within(f"{self.where}: reset_ticks", self.reset_ticks, 1, 10_000)
        seen: dict[str, str] = {}
        for key, name in {"top": self.top, **self._ports()}.items():
            if not _NAME.fullmatch(name):
                raise ArgumentError(f"{self.where}: {key}", repr(name)[:80], "a plain name of Verilog, such as a_in")
            if key != "top" and seen.setdefault(name, key) != key:
                raise ArgumentError(f"{self.where}: {key}", repr(name), f"a port that is not {seen[name]} already")

    @classmethod
    def read(cls, path: Path) -> Pins:
        """Read a pins file: TOML, each parameter a key.

        Raises
        ------
        FileFormatError, ArgumentError
            No TOML, an unknown key, a key that is missing, a value that is not allowed.
        """
        default = {"reset_active": Active.HIGH.value, "reset_ticks": 8}
        names = [field.name for field in fields(cls) if field.name not in (*default, "where")]
        section = Section(path, "", read_toml(path), default, optional=tuple(names))
        given = {name: section.text(name) for name in names if name not in _OPTIONAL or section.has(name)}
        return cls(
            **given,  # texts only
            reset_active=section.choice("reset_active", Active),
            reset_ticks=section.whole("reset_ticks", 1, 10_000),
            where=str(path),
        )

    @property
    def outputs(self) -> tuple[str, ...]:
        """Return the outputs: A, B, the completed total and, where there is one, the reason to refuse."""
        return self.a_out, self.b_out, self.completed, *([self.refused] if self.refused else [])

    def widths(self, ports: Iterable[Port]) -> dict[str, int]:
        """Return the bits of each port by its name.

        Raises
        ------
        ArgumentError
            A port that the module does not have, of the wrong direction or width; the module's ports are named.
        """
        known = {port.name: port for port in ports}
        for key, name in self._ports().items():
            is_input, (least, most) = _RULES[key]
            port, where = known.get(name), f"{self.where}: {key}"
            if port is None:
                said = ", ".join(known) or "none"
                raise ArgumentError(where, repr(name), f"a port of {self.top}: {said}"[:400], meant(name, known))
            if port.is_input != is_input:
                raise ArgumentError(where, repr(name), f"an {'input' if is_input else 'output'} of {self.top}")
            if not least <= port.bits <= most:
                wide = "1 bit" if most == 1 else f"{least} to {most} bits"
                raise ArgumentError(where, f"{name!r} of {port.bits} bits", f"a port of {wide}")
        return {name: port.bits for name, port in known.items()}

    def _ports(self) -> dict[str, str]:
        names = {key: getattr(self, key) for key in _RULES}
        return {key: name for key, name in names.items() if name is not None}
