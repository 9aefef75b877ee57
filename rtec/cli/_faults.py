"""The option ``--fault`` of ``rtec simulate``: faults of the open path and their moments."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING

from rtec.cli._groups import OptionGroup
from rtec.cli._parameters import option
from rtec.cli._words import OPEN_FAULTS, completing
from rtec.errors import ArgumentError
from rtec.units import parse_time_ps

if TYPE_CHECKING:
    from rtec.machine import OpenPath
    from rtec.machine.fault_kinds import FaultRow
    from rtec.machine.faults import Fault

_NAME = "--fault"
_SAID = re.compile(r"(?P<name>[^@]*)(?:@(?P<begin>.*?)(?:\.\.(?P<end>.*))?)?")


@dataclass(frozen=True, slots=True, kw_only=True)
class FaultOptions(OptionGroup):
    """What goes wrong."""

    PANEL = "Faults"

    fault: list[str] | None = option(
        _NAME,
        "NAME[@TIME]",
        "A fault from a moment on, or @FROM..UNTIL; drawn without one. A second one: both.",
        complete=completing(OPEN_FAULTS),
    )

    def refuse_box(self) -> None:
        """Refuse faults of the box, where an algorithm takes its place.

        Raises
        ------
        ArgumentError
            There is one.
        """
        if self.fault:
            from rtec.machine.open_fault_kinds import check_beside_box

            for text in self.fault:
                check_beside_box(_read(text)[0], name=_NAME)

    def at(self, path: OpenPath, seed: int) -> tuple[Fault, ...]:
        """Return the faults with their moments in a run; none where the user said none.

        Raises
        ------
        ArgumentError
            A name of none, a time that is wrong or behind the end of the run, more than two, the same twice, one that
            the box cannot have.
        """
        if not self.fault:
            return ()
        from rtec.machine.open_faults import check_possible, faults_at, length_ps

        faults = faults_at(length_ps(path), [_read(text) for text in self.fault], seed, name=_NAME)
        check_possible(path, faults, name=_NAME)
        return faults


def _read(text: str) -> tuple[FaultRow, int | None, int | None]:
    """Return class, begin and end of a fault as people write it."""
    from rtec.machine.open_fault_kinds import open_fault_named

    match = _SAID.fullmatch(" ".join(text.split()))
    if match is None:
        raise ArgumentError(_NAME, repr(text[:60]), "NAME, NAME@TIME or NAME@FROM..UNTIL, as 'power lost@2 ms..5 ms'")
    times = [None if match[key] is None else parse_time_ps(match[key], name=_NAME) for key in ("begin", "end")]
    return open_fault_named(match["name"], name=_NAME), times[0], times[1]
