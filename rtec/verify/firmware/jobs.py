"""Programs held to the whole contract of a design, as jobs of a campaign."""

from __future__ import annotations

from firmware_model import read_hex
from rtec.board import MICROCONTROLLERS, Microcontroller
from rtec.injector import Design
from rtec.verify.campaign.job import Choice, JobKind, Number, Parameters, Record
from rtec.verify.campaign.own_files import NONE, OwnFile, unpacked
from rtec.verify.contract.jobs import verdict_record
from rtec.verify.contract.suite import TRIES
from rtec.verify.firmware.check import FirmwareCheckPlan, check_firmware


def whole_program(parameters: Parameters, seed: int, run: int) -> Record:
    """Hold a program to the contract of a design: a verdict of ``rtec firmware check``, with the same numbers.

    Parameters
    ----------
    parameters
        ``design``, ``processor``, ``hold_latch`` (yes or no): words; ``phases`` and ``tries``, as of
        `FirmwareCheckPlan`. ``image`` may be left out: a program of the user's in the place of the design's own.
    seed, run
        Their sum is the seed of the hunt.
    """
    design, chip = Design.named(str(parameters["design"])), Microcontroller.named(str(parameters["processor"]))
    own = str(parameters.get("image", NONE))
    plan = FirmwareCheckPlan(
        image=read_hex(chip.image(design) if own == NONE else unpacked(own)[0]), design=design, microcontroller=chip,
        hold_latch=parameters["hold_latch"] == "yes", phases=int(parameters["phases"] or 0),
        tries=int(parameters["tries"] or 0), seed=seed + run,
    )  # fmt: skip
    return verdict_record(check_firmware(plan).to_dict(), "detail")


FIRMWARE = JobKind(
    does="The program of a design is held to the whole contract, on its processor.",
    function=f"{__name__}:whole_program",
    parameters=(
        Choice(name="design", words=tuple(design.value for design in Design)),
        Choice(name="processor", words=tuple(MICROCONTROLLERS)),
        Choice(name="hold_latch", words=("no", "yes"), default=("yes",)),
        Number(name="phases", low=1.0, high=1e4, default=24.0, whole=True),
        Number(name="tries", low=0.0, high=1e7, default=TRIES, whole=True),
        OwnFile(name="image", beside="design", python=False),
    ),
    by=("design", "processor", "hold_latch"),
)
