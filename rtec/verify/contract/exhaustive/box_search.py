"""All reachable states of encoder, box and decoder of a design, and the shortest way to one that is wrong."""

from __future__ import annotations

import itertools
import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from rtec._jit import new_record
from rtec.errors import ArgumentError, RtecError
from rtec.injector import InjectorSettings, _kernels
from rtec.injector._state_kernels import ARMED, IDLE, INJECTOR, LETTING_GO, WRITING
from rtec.readable import time_text
from rtec.signal._kernels import level_of_state, state_of_level
from rtec.verify.contract.contract import Contract
from rtec.verify.contract.exhaustive import _box_event_kernels as events, _search_kernels as kernels
from rtec.verify.contract.exhaustive._box_state_kernels import MODEL, fields_of
from rtec.verify.contract.exhaustive.encoder import EncoderModel
from rtec.verify.contract.exhaustive.result import Ending, Event, Way

BYTES = kernels.STATE.itemsize + 2 * np.dtype(np.int32).itemsize
"""That one state takes, with its two places in the table."""
_STRETCH = 100_000
_FIRST_ROOM = 1 << 17


def free_memory() -> float:
    """Return the bytes that are free, as Linux tells them; elsewhere infinity, and an allocation fails instead."""
    try:
        lines = Path("/proc/meminfo").read_text("ascii").splitlines()
    except OSError:
        return math.inf
    return 1024.0 * next(int(line.split()[1]) for line in lines if line.startswith("MemAvailable:"))


@dataclass(frozen=True, slots=True, kw_only=True)
class Grid:
    """Points of time that a design is searched on.

    Examples
    --------
    >>> from rtec.injector import Design, Processor, Timing
    >>> settings = InjectorSettings(design=Design.C, timing=Timing.of(Design.C, Processor.FAST))
    >>> Grid.of(settings, Contract.of(Design.C))
    Grid(grid_ps=25000, quiet=36, rest=44)
    """

    grid_ps: int
    """It divides all times of the box, except that of its speed gate."""
    quiet: int
    """Points after which only the clock of a rest tells two times apart."""
    rest: int
    """Points without an edge that stand for a rest."""

    @classmethod
    def of(cls, settings: InjectorSettings, contract: Contract, *, finer: int = 1) -> Grid:
        """Return the coarsest grid, or one that is ``finer`` times as fine.

        Raises
        ------
        ArgumentError
            The grid's period cannot be divided so.
        """
        timing, design = settings.timing, settings.design
        copies_ps = timing.latency_ps if design.in_path else 0
        gate_ps = timing.gate_ps(design)
        own = (timing.decide_ps, timing.step_ps, timing.recover_ps, timing.rest_ps, timing.poll_ps, copies_ps)
        grid_ps = math.gcd(*own, timing.poll_offset_ps)
        shortest_ps = round(contract.quarter_ps * (1.0 - contract.jitter))
        while grid_ps > shortest_ps:  # two edges of one direction are a point apart at least
            grid_ps //= next(k for k in range(2, grid_ps + 1) if grid_ps % k == 0)
        if finer < 1 or grid_ps % finer:
            raise ArgumentError("finer", finer, f"a divisor of {grid_ps} ps")
        grid_ps //= finer
        busy_ps = 2 * (timing.poll_ps + copies_ps) + timing.decide_ps + timing.recover_ps
        busy_ps += (design.step_counts + 1) * timing.step_ps
        longest_ps = max(busy_ps, gate_ps + 2 * grid_ps, contract.separation_ps, contract.turn_ps, 2 * shortest_ps)
        quiet = -(-longest_ps // grid_ps)
        begins = EncoderModel.of(contract, grid_ps=grid_ps, quiet=quiet).begins[-1]
        whole = timing.rest_ps // grid_ps
        least = max(quiet, begins) + 2
        least += (whole - least) % max(timing.poll_ps // grid_ps, 1)  # what is left out are whole periods of looks
        return cls(grid_ps=grid_ps, quiet=quiet, rest=min(least, whole))


class BoxSearch:
    """Search through the states of a built-in design.

    Parameters
    ----------
    settings
        Design, timing and choices.
    contract
        What is asked of it, and what the axis does.
    finer
        How much finer than the coarsest grid that divides all its times.

    Examples
    --------
    >>> from rtec.injector import Design, Processor, RealEdges, Timing
    >>> timing = Timing.of(Design.C, Processor.FAST)
    >>> box = InjectorSettings(design=Design.C, timing=timing, real_edges=RealEdges.HOLD)
    >>> search = BoxSearch(box, Contract.of(Design.C))
    >>> search.run(), search.found > 10_000
    (<Ending.PROVED: 'proved'>, True)
    """

    def __init__(self, settings: InjectorSettings, contract: Contract, *, finer: int = 1) -> None:
        self.settings, self.contract = settings, contract
        self.grid = Grid.of(settings, contract, finer=finer)
        grid_ps = self.grid.grid_ps
        self.encoder = EncoderModel.of(contract, grid_ps=grid_ps, quiet=self.grid.quiet)
        self._box, self._model, self._at = new_record(INJECTOR), new_record(MODEL), new_record(kernels.SEARCH)
        timing = replace(settings.timing, rest_ps=self.grid.rest * grid_ps)
        replace(settings, timing=timing).fill(self._box)
        self._box.gate_ps = settings.timing.gate_ps(settings.design)
        model = self._model
        model.grid_ps, model.step_counts = grid_ps, contract.step_counts
        model.gate = -(-int(self._box.gate_ps) // grid_ps) + 1
        model.classes, model.longest = len(self.encoder.begins), self.grid.rest
        for name in ("begins", "least_same", "least_turn"):
            model[name][: model.classes] = getattr(self.encoder, name)
        model.separation = -(-contract.separation_ps // grid_ps)
        model.delay = contract.delay_ps // grid_ps
        model.looks = max(timing.poll_ps // grid_ps, 1)
        self._states, self._table = np.zeros(0, kernels.STATE), np.zeros(0, np.int32)
        self._make_room(_FIRST_ROOM)
        states = range(4 if settings.design.one_state else 1)  # elsewhere all four are alike
        for number, (state, looked) in enumerate(itertools.product(states, range(model.looks))):
            _kernels.reset(self._box, level_of_state(state))
            events.begin(self._box, model, looked)
            self._states[number] = model.first, model.second, -1, 0
            self._at.found += 1
        kernels.enter_all(self._states, self.found, self._table)

    @property
    def found(self) -> int:
        """Return how many states are known."""
        return int(self._at.found)

    @property
    def waiting(self) -> int:
        """Return how many of them wait for their successors to be found."""
        return int(self._at.found - (self._at.next if self._at.end else self._at.begin))

    @property
    def made(self) -> int:
        """Return how many successors were made."""
        return int(self._at.made)

    @property
    def delay_ps(self) -> int:
        """Return the longest time for which a count was behind in the states found."""
        return int(self._fields()["off_for"].max()) * self.grid.grid_ps

    def run(
        self,
        *,
        most_states: int = 20_000_000,
        most_s: float = 600.0,
        progress: Callable[[int], None] = lambda found: None,
    ) -> Ending:
        """Search until all states are known, one is wrong, or there are too many.

        Raises
        ------
        RtecError
            There is no memory for the states.
        ArithmeticError
            A value that the words of a state do not hold.
        """
        end = time.monotonic() + most_s
        while True:
            how = kernels.search(self._at, self._states, self._table, self._box, self._model, _STRETCH)
            progress(self.found)
            if self._model.wide:
                raise ArithmeticError("a value of the model does not fit its bits")
            if how == kernels.DONE:
                return Ending.PROVED if self._comes_to_rest() and self._can_stand_still() else Ending.UNDECIDED
            if how == kernels.BROKEN:
                return Ending.BROKEN
            if self.found > most_states or time.monotonic() > end:
                return Ending.UNDECIDED
            if how == kernels.FULL:
                self._make_room(2 * self._states.size)

    def way(self) -> Way:
        """Return the shortest way to the state that is wrong, as the events outside the box."""
        return self._way(int(self._at.next), [int(self._at.how)])

    def way_to(self, number: int) -> Way:
        """Return the shortest way to one of the states found, by its number in the order of finding."""
        return self._way(number, [])

    def _way(self, number: int, hows: list[int]) -> Way:
        """Return the way to a state, and what happens from there on."""
        while self._states[number]["parent"] >= 0:
            hows.append(int(self._states[number]["how"]))
            number = int(self._states[number]["parent"])
        model, grid_ps, timing = self._model, self.grid.grid_ps, self.settings.timing
        first, second = self._states[number]["first"], self._states[number]["second"]
        seen: list[Event] = []
        points: list[int] = []  # of all that happened
        unread: int | None = None  # the last request, until its sign is looked at
        t_ps = free_ps = completed = asked = 0
        begun, looked = divmod(number, int(model.looks))
        by, sense = 0, 1  # the encoder's state is by + sense * that of the model
        for how in reversed(hows):
            kind, owed, sides, _ = events.event_of(how)
            before = {name: int(value) for name, value in fields_of(first, second).items()}
            events.follow(first, second, how, self._box, model)
            first, second = int(model.first), int(model.second)
            if kind == events.WAIT:
                stands = before["since"] == self.grid.rest - 2
                t_ps += grid_ps + (timing.rest_ps - self.grid.rest * grid_ps if stands else 0)
                continue
            points.append(t_ps)
            completed += sense * int(model.booked)
            have, wanted = asked - completed, sense * owed
            starts = kind == events.FIRE and before["phase"] == ARMED
            if starts and not owed:  # taken back behind the look, else it would have been dropped
                free_ps = max(free_ps, t_ps - timing.decide_ps)
            looks = starts or model.booked or before["phase"] in (IDLE, LETTING_GO, WRITING)
            if looks and (np.sign(have) != wanted if starts else bool(have) != bool(wanted)):
                asked = completed + wanted
                asked_ps = t_ps if kind == events.REQUEST else (free_ps + t_ps) // 2
                if have * wanted < 0 and unread is not None:  # it might as well have been this one from the start
                    seen[unread] = replace(seen[unread], total=asked)
                else:
                    unread = len(seen)
                    seen.append(Event(time_ps=asked_ps, total=asked, move=0, close=asked_ps in points[:-1]))
            unread = None if starts else unread
            free_ps = t_ps if looks else free_ps
            if kind in (events.UP, events.DOWN):
                seen.append(Event(time_ps=t_ps, total=0, move=sense * (kind - events.WAIT), close=sides != 0))
            by, sense = by + sense * int(model.by), sense * int(model.sense)
        crowded = {t for t in points if points.count(t) > 1}
        state = by + sense * state_of_level(int(fields_of(first, second)["levels"]))
        return Way(
            state=begun,
            events=tuple(replace(each, close=each.close or each.time_ps in crowded) for each in seen),
            end_ps=t_ps,
            late_ps=looked * grid_ps,
            grid_ps=grid_ps,
            completed=completed,
            levels=int(level_of_state(state & 3)),
        )

    def _fields(self) -> dict[str, np.ndarray]:
        found = self._states[: self.found]
        return fields_of(found["first"], found["second"])

    def _make_room(self, room: int) -> None:
        needed, free = room * BYTES, free_memory()
        try:
            if needed > free:
                raise MemoryError
            states = np.zeros(room, kernels.STATE)
            states[: self._states.size] = self._states
            self._states, self._table = states, np.zeros(0, np.int32)  # the old table goes before the new one comes
            self._table = np.full(2 * room, kernels.EMPTY, np.int32)
        except MemoryError:
            raise RtecError(
                f"{self.settings.design.title}: no memory for more than {self._states.size} states on a grid of"
                f" {time_text(self.grid.grid_ps)}: {needed / 1e9:.2f} GB needed, {free / 1e9:.2f} GB free; use a"
                f" lower --frequency or free memory"
            ) from None
        kernels.enter_all(self._states, self.found, self._table)

    def _comes_to_rest(self) -> bool:
        """Return whether from every state, with no more edges and requests, the box comes to rest or books a step.

        At rest the count is right and nothing is owed that it could insert: else the search would have ended there.
        """
        for owed in (-1, 0, 1):
            alone = np.zeros(self.found, np.int32)
            kernels.settle(self._states, self.found, self._table, self._box, self._model, owed, alone)
            after = alone
            for _ in range(self.found.bit_length()):
                after = after[after]
            if (alone[after] != after).any():
                return False
        return True

    def _can_stand_still(self) -> bool:
        """Return whether, late in a rest, nothing but the clock of the rest tells one point from the next.

        So any number of points may be left out there, and the shortened rest shows what the whole one does.
        """
        if self.grid.rest * self.grid.grid_ps == self.settings.timing.rest_ps:
            return True
        stands = self.grid.rest - 2
        decide = self.settings.timing.decide_ps // self.grid.grid_ps
        fields = self._fields()
        waits = (fields["phase"] == IDLE) | ((fields["phase"] == ARMED) & (fields["after"] >= 2 + decide))
        quiet = (fields["ready"] < 0) & (fields["off"] == 0) & (fields["out_line"] == 0)
        quiet &= fields["before"] >= self._model.gate if self._model.gate > 1 else True
        enough = max(*self.encoder.least_same, *self.encoder.least_turn, *self.encoder.begins) <= stands
        return enough and bool((waits & quiet)[fields["since"] == stands].all())
