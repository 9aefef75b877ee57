"""Plans of trials and what they show: the evidence."""

from rtec.campaign.firmware_check import FirmwareCheckPlan, check_firmware, default_frequencies
from rtec.campaign.firmware_check_results import Check, Executed, FirmwareVerdict, Moment, Seen, Trace

__all__ = [
    "Check",
    "Executed",
    "FirmwareCheckPlan",
    "FirmwareVerdict",
    "Moment",
    "Seen",
    "Trace",
    "check_firmware",
    "default_frequencies",
]
