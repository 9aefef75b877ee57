"""Which controller wrote a log, by what it begins with."""

from __future__ import annotations

from pathlib import Path

from rtec.metrology.controller_logs.halsampler import is_halsampler, read_halsampler
from rtec.metrology.controller_logs.sinumerik_edge import is_sinumerik_edge, read_sinumerik_edge
from rtec.metrology.controller_logs.sinumerik_trace import is_sinumerik_trace, read_sinumerik_trace
from rtec.metrology.controller_logs.twincat_scope import is_twincat_scope, read_twincat_scope
from rtec.metrology.tables.choices import ColumnChoices
from rtec.metrology.tables.table import Table

_FORMATS = (
    (is_sinumerik_edge, read_sinumerik_edge),
    (is_sinumerik_trace, read_sinumerik_trace),
    (is_twincat_scope, read_twincat_scope),
    (is_halsampler, read_halsampler),
)


def table_of_log(source: str | Path, text: str, choices: ColumnChoices) -> Table | None:
    r"""Return the log of a controller as a table, or None where the text is none; errors as of its reader.

    Examples
    --------
    >>> table_of_log("x.csv", "target_mm,actual_mm\n1,2\n", ColumnChoices()) is None
    True
    """
    return next((read(source, text, choices) for is_it, read in _FORMATS if is_it(text)), None)
