"""All reachable states of a user's Python class that declares its state finite, with encoder and ideal decoders."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from typing import Any

from rtec.errors import RtecError
from rtec.signal._kernels import ILLEGAL, count_delta, level_of_state, state_of_level
from rtec.verify.contract._python_child import checked
from rtec.verify.contract.contract import Contract
from rtec.verify.contract.exhaustive.encoder import EncoderModel
from rtec.verify.contract.exhaustive.result import Ending, Event, Way

_NOW_PS = 10**12
_LEVELS = (0, 1, 3, 2)
_MOST_OFF = 15
_TOGETHER, _BEFORE, _AFTER = 0, 1, 2
"""Inputs that come with the call that the class has asked for, a picosecond before it, or after it."""
_MANY = 1000
_NONE = 1 << 40

State = tuple[Any, ...]
"""Values of the attributes, levels at the encoder and at the controller, points to the next call (0: none), steps
owed, time since the last edge, direction and class of the motion, how far and how long a count is off, the line that
has changed last and since when."""


class ClassSearch:
    """Search through the states of a class with a step.

    The class says what its state is (docs/algorithm.md): ``TIMES`` names its attributes that are times, ``TOTALS``
    those that are totals of steps; ``GRID_PS`` divides its constants, and a time ``FORGETS_PS`` ago makes no
    difference.

    With ``together`` its inputs never come just before or just after its own calls: less than a proof, but whatever
    is wrong can be played.

    Raises
    ------
    RtecError
        A class that does not say so, or an attribute that is no plain value.

    Examples
    --------
    >>> from rtec.examples.mutants import COrder
    >>> from rtec.injector import Design
    >>> search = ClassSearch(COrder, Contract.of(Design.C))
    >>> search.run(), len(search.way().events)
    (<Ending.BROKEN: 'broken'>, 1)
    """

    def __init__(self, kind: Any, contract: Contract, *, window: int = 1, together: bool = False) -> None:
        declared: dict[str, Any] = {
            name: getattr(kind, name, None) for name in ("TIMES", "TOTALS", "GRID_PS", "FORGETS_PS")
        }
        missing = [name for name, value in declared.items() if value is None]
        if missing:
            raise RtecError(
                f"{kind.__name__} does not declare its state: {', '.join(missing)} missing; see docs/algorithm.md"
            )
        self.kind, self.contract, self.window, self.together = kind, contract, window, together
        self.grid_ps: int = declared["GRID_PS"]
        if not 0 < self.grid_ps <= contract.turn_ps:
            raise RtecError(
                f"{kind.__name__}.GRID_PS is {self.grid_ps}; 1 to {contract.turn_ps} ps, the time of a turn"
            )
        self._step = checked(kind)
        self._object = kind()
        self._begin_with = {name: getattr(self._object, name) for name in self._names()}
        wanted = {*declared["TIMES"], *declared["TOTALS"]} - self._begin_with.keys()
        if wanted:
            raise RtecError(f"{kind.__name__} has no attribute {', '.join(sorted(wanted))} of its TIMES and TOTALS")
        names = tuple(self._begin_with)
        self._attributes = names
        for name, value in self._begin_with.items():
            if not isinstance(value, int | float | str | tuple | frozenset | type(None)):
                kinds = "a number, a text, a tuple or a frozenset"
                raise RtecError(f"{kind.__name__}.{name} is a {type(value).__name__}; a finite state is {kinds}")
        self._times = [names.index(name) for name in declared["TIMES"]]
        self._totals = [names.index(name) for name in declared["TOTALS"]]
        self.forgets_ps: int = declared["FORGETS_PS"]
        self._forgets = -(-self.forgets_ps // self.grid_ps)
        quiet = max(self._forgets, round(2 * contract.quarter_ps) // self.grid_ps)
        self.encoder = EncoderModel.of(contract, grid_ps=self.grid_ps, quiet=quiet, speeds=2)
        self._longest = max(quiet, self.encoder.begins[-1])
        self._separation = -(-contract.separation_ps // self.grid_ps)
        self._delay = contract.delay_ps // self.grid_ps
        self.states: dict[State, tuple[State | None, tuple[int, int, int]]] = {}
        self.waiting = self.made = self.delay_ps = 0
        self._broken: tuple[State, tuple[int, int, int]] | None = None

    def _names(self) -> list[str]:
        """Return the names of all attributes that a step can change."""
        own = dict(vars(self._object))
        for kind in type(self._object).__mro__[:-1]:
            own |= {n: v for n, v in vars(kind).items() if not (n.startswith("__") or n.isupper() or callable(v))}
        return sorted(name for name, value in own.items() if not isinstance(value, property | staticmethod))

    @property
    def found(self) -> int:
        """Return how many states are known."""
        return len(self.states)

    def run(
        self,
        *,
        most_states: int = 1_000_000,
        most_s: float = 600.0,
        progress: Callable[[int], None] = lambda found: None,
    ) -> Ending:
        """Search until all states are known, one is wrong, or there are too many."""
        end = time.monotonic() + most_s
        layer: list[State] = []
        for level in _LEVELS:
            state = self._at_power_up(level)
            if state is None:
                return self._stop((level,), (0, 0, 0))
            self.states[state] = None, (0, 0, 0)
            layer.append(state)
        while layer:
            following: list[State] = []
            for done, state in enumerate(layer):
                self.waiting = len(layer) - done + len(following)
                if not done & 1023:
                    progress(self.found)
                    if self.found > most_states or time.monotonic() > end:
                        return Ending.UNDECIDED
                for how in self._choices(state):
                    self.made += 1
                    after = self._after(state, how)
                    if after is None:
                        return self._stop(state, how)
                    if after not in self.states:
                        self.states[after] = state, how
                        following.append(after)
            layer = following
        self.waiting = 0
        return Ending.PROVED

    def _stop(self, state: State, how: tuple[int, int, int]) -> Ending:
        self._broken = state, how
        return Ending.BROKEN

    def hint(self) -> str:
        """Return which attribute takes so many values that it may be a time or a total, or ""."""
        for k, name in enumerate(self._attributes):
            if len({state[0][k] for state in self.states}) > _MANY:
                return f"; {name} takes more than {_MANY} values: is it one of TIMES or TOTALS?"
        return ""

    def way(self) -> Way:
        """Return the shortest way to the state that is wrong, as the events outside the class."""
        if self._broken is None:
            raise ValueError("nothing is wrong")
        state, how = self._broken
        if len(state) == 1:  # at power-up
            begun = int(state_of_level(state[0]))
            return Way(
                state=begun, events=(), end_ps=self.grid_ps, late_ps=0, grid_ps=self.grid_ps, completed=0, levels=0
            )
        steps = [(state, how)]
        parent = self.states.get(state, (None, how))
        while parent[0] is not None:
            steps.append((parent[0], parent[1]))
            parent = self.states[parent[0]]
        events, completed, t_ps = [], 0, 0
        first = steps[-1][0]
        for k, (before, (owed, move, place)) in enumerate(reversed(steps)):
            t_ps += self.grid_ps
            if owed != before[4]:
                events.append(Event(time_ps=t_ps, total=completed + owed, move=0, close=place != _TOGETHER))
            if move:
                events.append(Event(time_ps=t_ps, total=0, move=move, close=place != _TOGETHER))
            if k + 1 < len(steps):
                completed += owed - steps[len(steps) - 2 - k][0][4]
        return Way(
            state=int(state_of_level(first[1])), events=tuple(events), end_ps=t_ps, late_ps=0, grid_ps=self.grid_ps,
            completed=completed, levels=0,
        )  # fmt: skip

    def _choices(self, state: State) -> Iterator[tuple[int, int, int]]:
        """Yield what may come at the next point: steps owed, an edge, and its place beside the class's own call."""
        _, _, _, wake, owed, since, direction, motion, *_ = state
        due = wake == 1
        since = min(since + 1, self._longest)
        for move in (0, 1, -1):
            if move and motion:
                least = self.encoder.least_same if move == direction else self.encoder.least_turn
                if since < least[motion]:
                    continue
            for asked in dict.fromkeys((owed, *range(-self.window, self.window + 1))):
                yield asked, move, _TOGETHER
                if due and not self.together and (move or asked != owed):
                    yield asked, move, _BEFORE
                    yield asked, move, _AFTER

    def _after(self, state: State, how: tuple[int, int, int]) -> State | None:  # noqa: C901 - one instant
        """Return the state at the next point, or None where it breaks the contract."""
        values, ab_in, ab_out, wake, owed, since, direction, motion, off, off_for, line, line_for = state
        asked, move, _ = how
        since = min(since + 1, self._longest)
        off_for = off_for + 1 if off else 0
        line, line_for = (line, line_for + 1) if line and line_for + 1 < self._separation else (0, 0)
        level = int(level_of_state((state_of_level(ab_in) + move) & 3))
        values = self._older(values)
        shown, booked, points = ab_out, 0, wake - 1 if wake else _NONE
        calls = self._calls(wake == 1, level, ab_in, how, owed)
        while calls:
            called = self._call(values, _NOW_PS, *calls.pop(0))
            if called is None:
                return None
            values, shown, booked, points = called
            if not calls and points <= 0:  # it is called at this very point
                calls.append((1, level, asked))
        points = 0 if points == _NONE else points
        values = self._less(values, booked)
        out = int(count_delta(ab_out, shown))
        if out == ILLEGAL:
            return None
        moved = move + self.contract.step_counts * booked
        off += out - moved
        if off in (0, -moved):
            off_for = 0
        if out:
            changed = ab_out ^ shown
            if line and line != changed:
                return None
            line, line_for = changed, 0
        self.delay_ps = max(self.delay_ps, off_for * self.grid_ps)
        if (off and off_for > self._delay) or abs(off) > _MOST_OFF:
            return None
        if move:
            motion = self.encoder.motion_after(motion, since, turns=move != direction)
            direction, since = move, 0
        after = (values, level, shown, points, asked - booked, since, direction, motion, off, off_for, line, line_for)
        if points == 0 or after == state:  # nothing will come any more by itself
            insertable = int(state_of_level(level)) in self.contract.states
            if off or (after[4] and insertable):
                return None
        return after

    def _calls(
        self, due: bool, level: int, level_before: int, how: tuple[int, int, int], owed: int
    ) -> list[tuple[int, int, int]]:
        """Return the calls at one point: picoseconds beside it, levels and steps that are owed."""
        asked, move, place = how
        inputs = bool(move) or asked != owed
        if not inputs:
            return [(0, level, asked)] if due else []
        if place == _BEFORE:
            return [(-1, level, asked)]
        if place == _AFTER:
            return [(0, level_before, owed), (1, level, asked)]
        return [(0, level, asked)]

    def _at_power_up(self, level: int) -> State | None:
        """Return the state at power-up, or None where it breaks the contract."""
        values = tuple(self._begin_with[name] for name in self._attributes)
        called = self._call(values, 0, 0, level, 0)
        if called is None or called[1] != level or called[2] != 0:
            return None
        points = 0 if called[3] == _NONE else max(called[3], 1)
        return called[0], level, level, points, 0, 0, 0, 0, 0, 0, 0, 0

    def _call(
        self, values: tuple[Any, ...], now_ps: int, shift: int, level: int, requested: int
    ) -> tuple[tuple[Any, ...], int, int, int] | None:
        """Call the step; return attributes, levels, steps booked and points to the next call, all times from now."""
        told = list(values)
        for k in self._times:
            told[k] += now_ps
        self._object.__dict__.clear()
        self._object.__dict__.update(zip(self._attributes, told, strict=True))
        t_ps = now_ps + shift
        try:
            ab, completed, wake_ps, _ = self._step(self._object, t_ps, level, requested)
        except Exception:  # whatever a user's code raises: the judge will say so
            return None
        if ab not in range(4) or (wake_ps and wake_ps <= t_ps):
            return None
        after = [getattr(self._object, name) for name in self._attributes]
        for k in self._times:
            after[k] = self._rounded(after[k] - now_ps) * self.grid_ps
        late = [k for k, value in enumerate(after) if isinstance(value, int) and abs(value) > _NOW_PS // 2]
        if now_ps and late:
            raise RtecError(f"{self.kind.__name__}.{self._attributes[late[0]]} holds a time and is not one of TIMES")
        points = self._rounded(wake_ps - now_ps) if wake_ps else _NONE
        return tuple(after), ab, completed, points

    def _rounded(self, t_ps: int) -> int:
        return (t_ps + self.grid_ps // 2) // self.grid_ps

    def _older(self, values: tuple[Any, ...]) -> tuple[Any, ...]:
        """Return attributes a point later; a time long ago stays where it is."""
        older = list(values)
        for k in self._times:
            older[k] = max(older[k] - self.grid_ps, -self._forgets * self.grid_ps)
        return tuple(older)

    def _less(self, values: tuple[Any, ...], booked: int) -> tuple[Any, ...]:
        """Return attributes with totals counted from what is completed."""
        less = list(values)
        for k in self._totals:
            less[k] -= booked
        return tuple(less)
