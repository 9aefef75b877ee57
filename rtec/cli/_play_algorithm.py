"""The option ``--algorithm`` of ``rtec simulate``, and what runs it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from rtec.cli import _console
from rtec.cli._groups import OptionGroup
from rtec.cli._parameters import apart, named, needs, option, processor, word
from rtec.cli._verb import said
from rtec.cli._words import PROCESSORS, files_ending

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from rtec.board import Microcontroller
    from rtec.cli._check_algorithm import Chosen
    from rtec.cli._faults import FaultOptions
    from rtec.cli._seen import Seen
    from rtec.injector import Design
    from rtec.injector.insertion_capture import InsertionCapture
    from rtec.machine import OpenPath
    from rtec.signal import VcdSignal
    from rtec.verify.contract.open_play import PlayedPath
    from rtec.verify.contract.trials import Trials

    Clock = tuple[int, int]
    """A period in ps as a ratio."""


@dataclass(frozen=True, slots=True, kw_only=True)
class AlgorithmOptions(OptionGroup):
    """An algorithm of one's own in the box; None where nothing was said."""

    PANEL = "An algorithm of your own"

    algorithm: str | None = option(
        "--algorithm",
        "ALGORITHM",
        "file.py:Name, top.v or image.ihx in the box; --design says step and states.",
        complete=files_ending(".py", ".v", ".sv", ".ihx", ".hex"),
    )
    clock_ps: Clock | None = named(
        "--clock", "rtec.verify.contract.verilog:clock_of", "50MHz", "Verilog's; a Python class then sees ticks only."
    )
    pins: Path | None = option("--pins", "P.toml", "Which port of the module is what.")
    processor: Microcontroller | None = processor(f"For machine code: {', '.join(PROCESSORS)}.")
    part: str | None = word("--part", "8051|8052", "For machine code.")

    def choose(self, context: typer.Context, design: Design, beside: tuple[str, ...]) -> Chosen | None:
        """Return the algorithm, None where there is none.

        Parameters
        ----------
        context
            Of the verb.
        design
            Says step and states.
        beside
            Parameters of the verb that mean nothing for an algorithm.

        Raises
        ------
        RtecError
            A file that cannot be used, or an option that is wrong or means nothing here.
        """
        if self.algorithm is None:
            own = said(context, *(item.name for item in fields(self) if item.name != "algorithm"))
            if own:
                raise needs(own[0], "--algorithm")
            return None
        words = said(context, *beside)
        if words:
            raise apart(words[0], "--algorithm", "it is of the box of a design")
        from rtec.cli._check_algorithm import choose
        from rtec.cli.check import ContractOptions, Options, RunnerOptions
        from rtec.injector import Design

        if self.algorithm.lower() in (known.value for known in Design):
            raise apart(f"--algorithm {self.algorithm}", "--design", "a design of rtec needs no --algorithm")
        nothing = {item.name: None for item in fields(ContractOptions)}
        own_runner = {item.name: getattr(self, item.name) for item in fields(self) if item.name != "algorithm"}
        runner = {item.name: None for item in fields(RunnerOptions)} | own_runner
        return choose(
            Options(
                algorithm=self.algorithm,
                contract=ContractOptions(**(nothing | {"design": design})),  # type: ignore[arg-type]  # by name
                runner=RunnerOptions(**runner),
            )
        )


def play(
    chosen: Chosen, moved: Callable[[Trials], OpenPath], wrong: FaultOptions, seed: int, seen: Seen, *, as_json: bool
) -> None:
    """Carry out a run with an algorithm in the place of the box.

    Parameters
    ----------
    chosen
        The algorithm.
    moved
        Returns the path in motion, for an algorithm whose time to settle is known.
    wrong, seed
        What goes wrong, and the seed of its moments.
    seen, as_json
        What the user wants to see.

    Raises
    ------
    typer.Exit
        With 1 where a count is wrong, or corrections are left over.
    """
    from rtec.report.terminal_played import show_played
    from rtec.report.terminal_simulate import show_outcome
    from rtec.verify.contract.open_play import play_path
    from rtec.verify.contract.trials import Trials

    trials = Trials(chosen.algorithm, chosen.contract)
    trials.measure_settling()
    path = moved(trials)
    faults = wrong.at(path, seed)
    capture = seen.check(path)
    played = play_path(trials, path, faults)
    if capture is not None or seen.vcd is not None:
        _see(played, seen, capture)
    written = seen.written(path, capture, name=chosen.word)
    if as_json:
        _console.print_json(played.to_dict() | {"seed": seed, "note": chosen.note()} | written)
    else:
        show_played(played, chosen.note())
        if played.outcome is not None:
            show_outcome(played.outcome)
        seen.say(written)
    if not played.good or (played.outcome is not None and not played.outcome.activated):
        raise typer.Exit(1)


def _see(played: PlayedPath, seen: Seen, capture: InsertionCapture | None) -> None:
    """Show both sides of the box to what looks for an insertion, and write them as waveforms."""
    import numpy as np

    from rtec.injector.waves import write_waves

    rows, initial = played.rows(), (played.stimulus.edges.initial, played.response.edges.initial)
    if capture is not None:
        capture.show(np.concatenate([[[0, *initial, 0, 0, 0]], rows]))
    if seen.vcd is not None:
        end_ps = played.stimulus.until_ps
        write_waves(seen.vcd, rows, initial=initial, end_ps=end_ps, beside=_marks(played, end_ps))


def _marks(played: PlayedPath, end_ps: int) -> list[tuple[VcdSignal, NDArray[np.int64], NDArray[np.int64]]]:
    """Return a signal for each fault, high from its moment to its end."""
    import numpy as np

    from rtec.machine.open_fault_kinds import word_of
    from rtec.signal import VcdSignal

    found = []
    for effect in played.outcome.effects if played.outcome is not None else ():
        times = np.array([effect.fault.from_ps, effect.fault.until_ps or end_ps], np.int64)
        signal = VcdSignal(scope="faults", name=word_of(effect.fault.kind).replace("-", "_"))
        found.append((signal, times[times < end_ps], np.array([1, 0], np.int64)[times < end_ps]))
    return found
