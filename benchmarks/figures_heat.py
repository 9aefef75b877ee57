"""How fast and how exact the simulated warm machine is, and what it has to compile."""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
from children import measure
from figures import Bar, Figure, Setting, Spread

from rtec.heat import Duty, WarmRun, warm_machine

sys.path.append(str(Path(__file__).parents[1] / "tests" / "oracles"))

_COMMAND = "python benchmarks/measure.py --only heat"
_DUTY = Duty.paper(spindle_rpm=5000.0)
_FIRST_RUN = "from rtec.heat import Duty, warm_machine; warm_machine().run(Duty.paper())"


def heat(setting: Setting) -> Iterator[Figure]:
    """Measure the time of a run, its errors, and the first run."""
    machine = warm_machine()
    spread = _times(lambda: machine.run(_DUTY), setting.rounds)
    run = machine.run(_DUTY)
    yield Figure(
        what=f"2.5 h at 5000 rev/min and 2 h of cooling: {run.time_s.size} rows, {len(run.heat.nodes)} nodes, "
             f"{len(run.thermometers)} thermometers, five displacements",
        measured=f"{spread.best:.3f} s (median {spread.median:.3f} s)", value=spread.best,
        bar=Bar(value=0.1, unit="s", at_most=True), command=_COMMAND,
    )  # fmt: skip
    for name, value, most, unit in (
        ("largest difference of a temperature from Radau of scipy", _from_radau(run), 0.005, "K"),
        ("heat put in that is neither stored, nor lost, nor carried off", _unbalanced(run), 1e-6, "of it"),
    ):
        yield Figure(
            what=f"The same: {name}", measured=f"{value:.1g} {unit}", value=value,
            bar=Bar(value=most, unit=unit, at_most=True), command=_COMMAND,
        )  # fmt: skip
    folder = Path(tempfile.gettempdir())
    with tempfile.TemporaryDirectory() as cache:
        words = [sys.executable, "-c", _FIRST_RUN]
        cold, warm = (measure(words, folder, NUMBA_CACHE_DIR=cache).cpu_s for _ in range(2))
    yield Figure(
        what="What the first run compiles, processor time",
        measured=f"{cold - warm:.1f} s ({cold:.1f} s less {warm:.1f} s warm)", value=cold - warm,
        bar=Bar(value=15.0, unit="s", at_most=True), command=_COMMAND,
    )  # fmt: skip


def _times(work: Callable[[], object], rounds: int) -> Spread:
    """Return the processor times of some rounds after one that does not count, in s."""
    work()
    taken = []
    for _ in range(rounds):
        begin = time.process_time()
        work()
        taken.append(time.process_time() - begin)
    return Spread(tuple(taken))


def _from_radau(run: WarmRun) -> float:
    from heat_oracle import HeatOracle

    machine, rows = warm_machine(), slice(None, None, 60)
    wanted, _ = HeatOracle(machine.network, machine.room).run(_DUTY, run.time_s[rows])
    return float(np.abs(run.heat.degc[rows] - wanted).max())


def _unbalanced(run: WarmRun) -> float:
    heat = run.heat
    left = heat.put_in_j - heat.to_room_j - heat.carried_off_j - heat.stored_j
    return float(np.abs(left).max() / heat.put_in_j[-1])
