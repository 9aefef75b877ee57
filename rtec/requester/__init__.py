"""The conversation between PC and box: requests, windows, "I Don't Believe You", start-up, probing; and its nodes."""

from rtec.requester.dialogue import Answer, BoxSide, PcSide
from rtec.requester.pc_node import PcNode, PcView
from rtec.requester.precautions import HoldReason, Precautions
from rtec.requester.settings import BoxState, Conversation, PcState, Status
from rtec.requester.setup import Setup

__all__ = [
    "Answer",
    "BoxSide",
    "BoxState",
    "Conversation",
    "HoldReason",
    "PcNode",
    "PcSide",
    "PcState",
    "PcView",
    "Precautions",
    "Setup",
    "Status",
]
