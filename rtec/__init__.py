"""Emulator of a real-time error corrector (RTEC) between an encoder and a machine-tool controller.

The rooms, in the order in which a pulse meets them: :mod:`rtec.signal`, :mod:`rtec.axis`, :mod:`rtec.injector`,
:mod:`rtec.controller`; in the order of a correction: :mod:`rtec.predictors`, :mod:`rtec.requester`,
:mod:`rtec.link`. :mod:`rtec.machine` joins them, :mod:`rtec.metrology` measures the result, :mod:`rtec.study` and
:mod:`rtec.report` tell it.
"""

__version__ = "0.1.0"
