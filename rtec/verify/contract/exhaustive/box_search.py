"""All reachable states of encoder, box and decoder of a design, and the shortest way to one that is wrong."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from rtec._jit import new_record
from rtec.errors import ArgumentError
from rtec.injector import InjectorSettings, _kernels
from rtec.injector._state_kernels import ARMED, IDLE, INJECTOR
from rtec.verify.contract.contract import Contract
from rtec.verify.contract.exhaustive import _search_kernels as kernels
from rtec.verify.contract.exhaustive._box_instant_kernels import ORDERS
from rtec.verify.contract.exhaustive._box_state_kernels import MODEL, NOW_PS, pack_state, unpack_state
from rtec.verify.contract.exhaustive.encoder import EncoderModel
from rtec.verify.contract.exhaustive.result import Ending, Event, Way

WINDOW = 3
"""Steps that can be owed, either way: the report's window."""
_STRETCH = 100_000
_FIRST_ROOM = 1 << 17
_START_LEVELS = (0, 1, 3, 2)


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
    """It divides all times of the box."""
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
        own = (
            timing.decide_ps,
            timing.step_ps,
            timing.recover_ps,
            timing.rest_ps,
            timing.poll_ps,
            copies_ps,
            gate_ps,
        )
        grid_ps = math.gcd(*own, timing.poll_offset_ps)
        while grid_ps > contract.turn_ps:  # a turn takes a point at least
            grid_ps //= next(k for k in range(2, grid_ps + 1) if grid_ps % k == 0)
        if finer < 1 or grid_ps % finer:
            raise ArgumentError("finer", finer, f"a divisor of {grid_ps} ps")
        grid_ps //= finer
        shortest_ps = round(contract.quarter_ps * (1.0 - contract.jitter))
        busy_ps = 2 * (timing.poll_ps + copies_ps) + timing.decide_ps + timing.recover_ps
        busy_ps += (design.step_counts + 1) * timing.step_ps
        longest_ps = max(busy_ps, gate_ps, contract.separation_ps, contract.turn_ps, 2 * shortest_ps)
        quiet = -(-longest_ps // grid_ps)
        begins = EncoderModel.of(contract, grid_ps=grid_ps, quiet=quiet).begins[-1]
        return cls(grid_ps=grid_ps, quiet=quiet, rest=min(max(quiet, begins) + 2, timing.rest_ps // grid_ps))


class BoxSearch:
    """Search through the states of a built-in design.

    Parameters
    ----------
    settings
        Design, timing and choices.
    contract
        What is asked of it, and what the axis does.
    window
        Steps that can be owed, either way.
    finer
        How much finer than the coarsest grid that divides all its times.

    Examples
    --------
    >>> from rtec.injector import Design, Processor, RealEdges, Timing
    >>> timing = Timing.of(Design.C, Processor.FAST)
    >>> box = InjectorSettings(design=Design.C, timing=timing, real_edges=RealEdges.HOLD)
    >>> search = BoxSearch(box, Contract.of(Design.C), window=1)
    >>> search.run(), search.found > 100_000
    (<Ending.PROVED: 'proved'>, True)
    """

    def __init__(
        self, settings: InjectorSettings, contract: Contract, *, window: int = WINDOW, finer: int = 1
    ) -> None:
        self.settings, self.contract, self.window = settings, contract, window
        self.grid = Grid.of(settings, contract, finer=finer)
        grid_ps = self.grid.grid_ps
        self.encoder = EncoderModel.of(contract, grid_ps=grid_ps, quiet=self.grid.quiet)
        self._box, self._model, self._at = new_record(INJECTOR), new_record(MODEL), new_record(kernels.SEARCH)
        timing = replace(settings.timing, rest_ps=self.grid.rest * grid_ps)
        replace(settings, timing=timing).fill(self._box)
        model = self._model
        model.grid_ps, model.window, model.step_counts = grid_ps, window, contract.step_counts
        model.classes, model.longest = len(self.encoder.begins), self.grid.rest
        for name in ("begins", "least_same", "least_turn"):
            model[name][: model.classes] = getattr(self.encoder, name)
        model.separation = -(-contract.separation_ps // grid_ps)
        model.delay = contract.delay_ps // grid_ps
        model.looks = max(timing.poll_ps // grid_ps, 1)
        self._states = np.zeros((0, 2), np.int64)
        self._parents, self._hows, self._silent = (np.zeros(0, np.int32) for _ in range(3))
        self._make_room(_FIRST_ROOM)
        for level in _START_LEVELS:
            _kernels.reset(self._box, level)
            self._box.last_edge_ps = NOW_PS  # as `BuiltIn`: a rest counts only once it was seen
            pack_state(self._box, model, NOW_PS, self._states[int(self._at.found)])
            self._at.found += 1
        kernels.enter_all(self._states, self.found, self._table)

    @property
    def found(self) -> int:
        """Return how many states are known."""
        return int(self._at.found)

    @property
    def waiting(self) -> int:
        """Return how many of them wait for their successors to be found."""
        return int(self._at.found - self._at.next)

    @property
    def made(self) -> int:
        """Return how many successors were made."""
        return int(self._at.made)

    @property
    def delay_ps(self) -> int:
        """Return the longest time for which a count was behind in the states found."""
        return int((self._states[: self.found, 1] & 16383).max()) * self.grid.grid_ps

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
        ArithmeticError
            A value that the words of a state do not hold.
        """
        end = time.monotonic() + most_s
        words = np.zeros(2, np.int64)
        while True:
            how = kernels.search(
                self._at, self._states, self._parents, self._hows, self._silent, self._table, words, self._box,
                self._model, ORDERS, int(self._at.next) + _STRETCH,
            )  # fmt: skip
            progress(self.found)
            if self._at.wide:
                raise ArithmeticError("a value of the model does not fit its bits")
            if how == kernels.DONE:
                return Ending.PROVED if self._comes_to_rest() and self._can_stand_still() else Ending.UNDECIDED
            if how == kernels.BROKEN:
                return Ending.BROKEN
            if self.found > most_states or time.monotonic() > end:
                return Ending.UNDECIDED
            if how == kernels.FULL:
                self._make_room(2 * self._states.shape[0])

    def way(self) -> Way:
        """Return the shortest way to the state that is wrong, as the events outside the box."""
        return self._way(int(self._at.parent), [int(self._at.how)])

    def way_to(self, number: int) -> Way:
        """Return the shortest way to one of the states found, by its number in the order of finding."""
        return self._way(number, [])

    def _way(self, number: int, hows: list[int]) -> Way:
        """Return the way to a state, and what happens from there on."""
        while self._parents[number] >= 0:
            hows.append(int(self._hows[number]))
            number = int(self._parents[number])
        words, after = self._states[number].copy(), np.zeros(2, np.int64)
        grid_ps, stands = self.grid.grid_ps, self.grid.rest - 2
        longer_ps = self.settings.timing.rest_ps - self.grid.rest * grid_ps
        events, t_ps, completed = [], 0, 0
        for how in reversed(hows):
            since = int(words[1]) >> 50
            t_ps += grid_ps + (longer_ps if since == stands else 0)
            owed_before = ((int(words[1]) >> 32) & 15) - self.window - 1
            kernels.follow(words, how, self._box, self._model, ORDERS, after)
            owed, move = ((how >> 9) & 15) - 8, ((how >> 7) & 3) - 1
            close = how & 127 != 0
            if owed != owed_before:
                events.append(Event(time_ps=t_ps, total=completed + owed, move=0, close=close))
            if move:
                events.append(Event(time_ps=t_ps, total=0, move=move, close=close))
            completed += int(self._model.booked)
            words, after = after, words
        return Way(
            state=number, events=tuple(events), end_ps=t_ps, looks=int(self._model.looks), grid_ps=grid_ps,
            completed=completed, levels=(int(words[0]) >> 17) & 3,
        )  # fmt: skip

    def _make_room(self, room: int) -> None:
        known = self._states.shape[0]
        states = np.zeros((room, 2), np.int64)
        states[:known] = self._states
        self._states = states
        for name in ("_parents", "_hows", "_silent"):
            numbers = np.full(room, -1, np.int32)
            numbers[:known] = getattr(self, name)
            setattr(self, name, numbers)
        self._table = np.full(2 * room, kernels.EMPTY, np.int32)
        kernels.enter_all(self._states, self.found, self._table)

    def _comes_to_rest(self) -> bool:
        """Return whether from every state, with no more edges and requests, the box comes to rest.

        There the count is right and nothing is owed that it could insert: else the search would have ended there.
        """
        silent = self._silent[: self.found]
        after = silent
        for _ in range(int(self.found).bit_length()):
            after = after[after]
        return bool((silent[after] == after).all())

    def _can_stand_still(self) -> bool:
        """Return whether, late in a rest, nothing but the clock of the rest tells one point from the next.

        So any number of points may be left out there, and the shortened rest shows what the whole one does.
        """
        found = self._states[: self.found]
        if self.grid.rest * self.grid.grid_ps == self.settings.timing.rest_ps:
            return True
        stands = self.grid.rest - 2
        timing, design = self.settings.timing, self.settings.design
        gate = timing.gate_ps(design) // self.grid.grid_ps
        decide = timing.decide_ps // self.grid.grid_ps
        fields = unpack_state(found[found[:, 1] >> 50 == stands])
        waits = (fields["phase"] == IDLE) | ((fields["phase"] == ARMED) & (fields["after"] >= 2 + decide))
        quiet = (fields["ready"] == 0) & (fields["off"] == 0) & (fields["out_line"] == 0) & (fields["before"] >= gate)
        enough = max(*self.encoder.least_same, *self.encoder.least_turn, *self.encoder.begins) <= stands
        return enough and bool((waits & quiet).all())
