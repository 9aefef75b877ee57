"""Plans of trials and what they show: the evidence."""

from rtec.campaign.firmware_check import FirmwareCheckPlan, check_firmware, default_frequencies
from rtec.campaign.firmware_check_results import Check, FirmwareVerdict, Trace

__all__ = [
    "Check",
    "FirmwareCheckPlan",
    "FirmwareVerdict",
    "Trace",
    "check_firmware",
    "default_frequencies",
]
