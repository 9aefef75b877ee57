"""The machine-tool controller's input: digital filter, quadrature decoder, fault policy, latches."""

from rtec.controller.receiver import (
    IllegalClass,
    IllegalPolicy,
    IllegalTransition,
    Multiplication,
    Receiver,
    ReceiverResult,
    ReceiverSettings,
)

__all__ = [
    "IllegalClass",
    "IllegalPolicy",
    "IllegalTransition",
    "Multiplication",
    "Receiver",
    "ReceiverResult",
    "ReceiverSettings",
]
