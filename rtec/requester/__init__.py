"""The conversation between PC and box: requests, windows, "I Don't Believe You", start-up, probing."""

from rtec.requester.dialogue import Answer, BoxSide, PcSide
from rtec.requester.settings import Conversation, PcState, Status

__all__ = ["Answer", "BoxSide", "Conversation", "PcSide", "PcState", "Status"]
