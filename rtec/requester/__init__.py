"""The handshake between PC and box: requests, windows, "I Don't Believe You", start-up, probing; and its nodes."""

from rtec.requester.dialogue import Answer, BoxSide, PcSide
from rtec.requester.pc_node import PcNode, PcView
from rtec.requester.settings import BoxState, HandshakeSettings, PcState, Status
from rtec.requester.setup import Setup
from rtec.requester.supervision import HoldReason, SupervisionLimits

__all__ = [
    "Answer",
    "BoxSide",
    "BoxState",
    "HandshakeSettings",
    "HoldReason",
    "PcNode",
    "PcSide",
    "PcState",
    "PcView",
    "Setup",
    "Status",
    "SupervisionLimits",
]
