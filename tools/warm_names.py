"""Diagnose drawn warm machines, with and without their sensors: ``python -m tools.warm_names``.

Prints the table of docs/warm-machine.md on standard output; progress goes to standard error.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rtec.dataset.dataset import Dataset
from rtec.dataset.load import load_dataset
from rtec.heat import Duty, WarmRun, warm_machine
from rtec.inference.diagnose import diagnose
from rtec.inference.fit import residual_of
from rtec.metrology import measurement_of_columns

_TRAINED = Duty.steps((1500.0, 3000.0, 4500.0, 6000.0), running_h=2.0, resting_h=2.0)
_CHANNELS = ("x1", "y1", "z")
_EVERY_S, _NOISE_UM = 60.0, 0.2
_OF_HEAT = frozenset({"thermal_shift"})
_FILES = {"speed and 13 temperatures": (), "speed alone": ("temperature",), "neither": ("temperature", "spindle")}
"""What a file holds beside time and displacement, and the columns that are left out for that."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Answer:
    """What one diagnosis found: its names, and what is left of the displacement, in um."""

    names: frozenset[str]
    before_um: float
    heldout_um: float
    other_before_um: float
    other_um: float

    @property
    def verdict(self) -> str:
        """Whether heat was named, and alone."""
        if not self.names & _OF_HEAT:
            return "nothing" if not self.names else "something else"
        return "heat" if self.names <= _OF_HEAT else "heat and more"


def dataset(run: WarmRun, channel: str, without: tuple[str, ...], seed: int) -> Dataset:
    """Return what a person would have measured each minute, without some columns."""
    rows = slice(0, None, round(_EVERY_S / float(run.time_s[1] - run.time_s[0])))
    noise = np.random.default_rng(seed).normal(0.0, _NOISE_UM, run.time_s[rows].size)
    columns = {"time_s": run.time_s[rows], "spindle_rpm": run.spindle_rpm[rows]}
    columns |= {f"temperature_{name}_degc": values[rows] for name, values in run.thermometers.items()}
    columns |= {"moved_um": run.displacement_um[channel][rows] + noise}
    kept = {name: values.tolist() for name, values in columns.items() if not name.startswith(without or ("-",))}
    return load_dataset(measurement_of_columns(kept), observe="moved")


def answers(machines: int, without: tuple[str, ...]) -> list[Answer]:
    """Return what was found of each channel of each machine, and what it says of a shift of a workshop."""
    found = []
    for seed in range(machines):
        machine = warm_machine(seed)
        run, shift = machine.run(_TRAINED, seed=seed), machine.run(Duty.shop(seed + 1000), seed=seed)
        for channel in _CHANNELS:
            result = diagnose(dataset(run, channel, without, seed))
            other = dataset(shift, channel, without, seed)
            found.append(
                Answer(
                    names=frozenset(result.model.names),
                    before_um=1e3 * result.rms_heldout_before,
                    heldout_um=1e3 * result.rms_heldout,
                    other_before_um=1e3 * float(np.std(other.observed)),
                    other_um=1e3 * float(np.std(residual_of(other, result.model))),
                )
            )
        print(f"machine {seed + 1} of {machines}", file=sys.stderr)  # noqa: T201 - a tool tells how far it is
    return found


def row(what: str, found: Sequence[Answer]) -> str:
    """Return a row of the table: how often heat was named, and medians of the errors."""
    verdicts = [one.verdict for one in found]
    counts = [verdicts.count(one) for one in ("heat", "heat and more", "something else", "nothing")]
    beside = sorted({name for one in found for name in one.names - _OF_HEAT})
    medians = [
        f"{np.median([getattr(one, name) for one in found]):.1f}"
        for name in ("before_um", "heldout_um", "other_before_um", "other_um")
    ]
    return f"| {what} | {' | '.join(map(str, counts))} | {', '.join(beside) or 'none'} | {' | '.join(medians)} |"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description="Diagnose drawn warm machines.")
    parser.add_argument("--machines", type=int, default=20)
    machines = parser.parse_args().machines
    lines = [row(what, answers(machines, without)) for what, without in _FILES.items()]
    heads = (
        "the file holds", "heat", "heat and more", "something else", "nothing", "what else", "before (um)",
        "held out (um)", "a shop's shift (um)", "left of it (um)",
    )  # fmt: skip
    print("| " + " | ".join(heads) + " |", "|" + "---|" * len(heads), *lines, sep="\n")  # noqa: T201 - its only output


if __name__ == "__main__":
    main()
