"""The machine-tool controller's input: digital filter, quadrature decoder, fault policy, latches."""

from rtec.controller.receiver import IllegalPolicy, Multiplication, Receiver, ReceiverResult, ReceiverSettings

__all__ = [
    "IllegalPolicy",
    "Multiplication",
    "Receiver",
    "ReceiverResult",
    "ReceiverSettings",
]
