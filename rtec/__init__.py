"""Emulator of a real-time error corrector (RTEC) between an encoder and a machine-tool controller.

In a notebook or a program:

>>> import rtec
>>> x = [5.0 * k for k in range(9)] * 4
>>> data = rtec.read({"target_mm": x, "deviation_um": [0.2 * v for v in x], "run": [k // 9 for k in range(36)]})
>>> rtec.add("scale", data).model
<rtec.Model of deviation: scale 200 µm/m>

``read`` takes a file, a data frame or a mapping of columns. ``compare`` shows what a ``Model`` leaves of it,
``diagnose`` finds which effects it lacks, ``add`` puts one in, ``train`` fits predictors. ``effect`` and ``Within``
make an effect of a function that you wrote; ``Effect`` is the class for larger ones; ``rtec.effects.LIBRARY`` lists
those that come with rtec. ``simulate`` runs the open signal path, ``run`` a whole study. Each has the words of the
command of its name; docs/python.md shows them in a notebook.

The rooms, in the order in which a pulse meets them: :mod:`rtec.signal`, :mod:`rtec.axis`, :mod:`rtec.injector`,
:mod:`rtec.controller`; in the order of a correction: :mod:`rtec.predictors`, :mod:`rtec.requester`,
:mod:`rtec.link`. :mod:`rtec.machine` joins them, :mod:`rtec.metrology` measures the result, :mod:`rtec.study` and
:mod:`rtec.report` tell it.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rtec.effects import Effect
    from rtec.effects.own import effect
    from rtec.effects.own_signature import Within
    from rtec.errors import RtecError
    from rtec.python import Data, Model, add, compare, diagnose, read, run, simulate, train

__version__ = "0.1.0"
__all__ = [
    "Data",
    "Effect",
    "Model",
    "RtecError",
    "Within",
    "add",
    "compare",
    "diagnose",
    "effect",
    "effects",
    "read",
    "run",
    "simulate",
    "train",
]

_FROM = {
    "Effect": "rtec.effects",
    "Within": "rtec.effects.own",
    "effect": "rtec.effects.own",
    "RtecError": "rtec.errors",
}


def __getattr__(name: str) -> Any:
    """Load what is asked for, so that ``import rtec`` loads nothing."""
    if name not in __all__:
        raise AttributeError(f"module 'rtec' has no attribute {name!r}")
    if name == "effects":
        return importlib.import_module("rtec.effects")
    found = getattr(importlib.import_module(_FROM.get(name, "rtec.python")), name)
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    return sorted([*__all__, "__version__"])
