"""The moves of a program, one after the other: what is commanded in place of what is written."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace

from rtec.predictors import FORWARD, REVERSE
from rtec.study.gcode.arcs import PLANES, Arc, arc_of
from rtec.study.gcode.axis import AxisCorrection, ErrorLeft
from rtec.study.gcode.modes import CYCLE, LINEAR, ROTARY, Modes
from rtec.study.gcode.paths import Path, Piece
from rtec.study.gcode.words import Line, Word, inserted, line_of, replaced

FAR_MM = 1.0
"""From this length on a piece is judged at three places, else at one."""
_AT_END = frozenset({0.0, 1.0, 2.0, 5.0, 9.0, 30.0, 60.0})
"""Words of M that act when the move is over."""
_ENDS = frozenset({2.0, 30.0})
_TOOL = 6.0
_SPLIT = frozenset("NGMFSTDHXYZUVWABC")
"""Letters of moves that can be split: an E would be pushed out in the first piece."""
_ROTARY_DIGITS = 5
_FINER = 3
"""Digits more where a number of the program is written again."""
_SHORT = 10.0
"""Steps of the numbers: an arc whose ends are no farther apart is a line."""
_Places = Mapping[str, float]


@dataclass(slots=True)
class Moves:
    """An interpreter that writes each line anew in which the corrected axis moves.

    Parameters
    ----------
    modes
        As the control has them when the program begins.
    correction, left
        Of the axis; and what judges the result.
    resolution_mm
        Steps of the numbers that are written, at most.
    within_mm
        How far an arc may be from what the correction asks for.
    """

    modes: Modes
    correction: AxisCorrection
    left: ErrorLeft
    resolution_mm: float
    within_mm: float
    at: dict[str, float | None] = field(default_factory=lambda: dict.fromkeys(LINEAR + ROTARY))
    """Where the program has led each axis, in mm or degrees; None: unknown."""
    sent_mm: float = math.nan
    """What the corrected axis was commanded last."""
    way: int = 0
    """Its direction; 0: unknown."""
    fed: bool = False
    """Whether a feed has been stated."""
    ended: bool = False
    tapes: int = 0
    """Lines of % so far: the second ends the program."""
    moves: int = 0
    """Moves of the axis."""
    outside: int = 0
    """Those that end beyond the range of the correction."""

    def take(self, text: str) -> list[str]:
        """Return the lines that take the place of one."""
        self.modes.number += 1
        if self.ended:
            return [text]
        if text.lstrip().startswith("%"):
            self.tapes += 1
            self.ended = self.tapes > 1
            return [text]
        line = line_of(text)
        if not line.words and not line.letters and not line.keywords and not line.computed:
            return [text]
        self._check(line)
        before = replace(self.modes) if line.codes else self.modes
        followed = self.modes.take(line)
        if followed:
            found = self._followed(line, before)
        else:
            found = [text]
            gone = self.modes.left_behind(line)
            self.at.update(dict.fromkeys(gone))
            self.way = 0 if self.modes.axis in gone else self.way
        self.fed = self.fed or "F" in line.letters
        self.ended = any(word.letter == "M" and word.value in _ENDS for word in line.words)
        return found

    def _check(self, line: Line) -> None:
        if "O" in line.letters and self.moves:
            raise self.modes.error("a second program in the file", "a file for each program")
        if any(word.letter == "M" and word.value == _TOOL for word in line.words):
            self.modes.note("a change of tools may move the axis: its direction is that of the program's places")

    def _followed(self, line: Line, before: Modes) -> list[str]:
        words = {word.letter: word for word in line.words if word.letter in LINEAR + ROTARY}
        motion, own = self.modes.motion, self.modes.axis
        bent = motion in ("G2", "G3") and bool(words or line.letters & set("IJK"))
        if not words and not bent:
            return [line.text]
        if not motion:
            raise self.modes.error("a move before G0, G1, G2 or G3", "one of them first")
        targets = {letter: self._target(letter, word) for letter, word in words.items()}
        if own in targets and targets[own] is None:
            raise self.modes.error(
                f"an increment of {own} from an unknown place", f"G90 and a position of {own} first"
            )
        path = self._bent(line, words, targets) if bent else self._straight(targets)
        if motion == CYCLE and own == self.modes.normal:
            raise self.modes.error(f"a cycle along {own}", f"moves of {own} written out")
        if motion == CYCLE and not self.modes.absolute and line.letters & set("KL"):
            raise self.modes.error("a cycle that is repeated in increments", "its holes written out")
        if path is not None:
            self._count(path.end[own])
            found = self._split(line, words, path, before)
        elif own in words:
            found = [self._sent_at_once(line, words[own], targets[own] or 0.0)]
        else:
            found = [line.text]
        self.at.update(targets)
        if motion == CYCLE:
            self.at[self.modes.normal] = None
        return found

    def _target(self, letter: str, word: Word) -> float | None:
        value, here = word.value * self.modes.unit_of(letter), self.at[letter]
        if self.modes.absolute:
            return value
        return None if here is None else here + value

    def _straight(self, targets: Mapping[str, float | None]) -> Path | None:
        """Return a feed move of the axis from a known place; None of any other."""
        own = self.modes.axis
        begin = _known({letter: self.at[letter] for letter in targets})
        end = _known(targets)
        known = len(begin) == len(end) == len(targets)
        if self.modes.motion != "G1" or own not in targets or not known:
            return None
        return Path(own=own, begin=begin, end=end)

    def _bent(self, line: Line, words: Mapping[str, Word], targets: Mapping[str, float | None]) -> Path | None:
        """Return an arc in which the axis moves; None of any other."""
        first, second, *offsets = PLANES[self.modes.plane]
        own = self.modes.axis
        if own not in (first, second, *words):
            return None
        if "P" in line.letters:
            raise self.modes.error("an arc of several turns", "a turn in each line")
        letters = dict.fromkeys((first, second, *words))
        begin = _known({letter: self.at[letter] for letter in letters})
        end = _known({letter: targets.get(letter, self.at[letter]) for letter in letters})
        if not len(begin) == len(end) == len(letters):
            raise self.modes.error("an arc from an unknown place", "positions of its axes first")
        given = {letter: word.value * self.modes.unit_mm for letter in (*offsets, "R") if (word := line.word(letter))}
        centre = None
        if "R" not in given:
            centre = begin[first] + given.get(offsets[0], 0.0), begin[second] + given.get(offsets[1], 0.0)
        start, goal = ((places[first], places[second]) for places in (begin, end))
        arc = arc_of(start, goal, centre, given.get("R"), counterclockwise=self.modes.motion == "G3")
        if not isinstance(arc, Arc):
            raise self.modes.error(arc, "I, J and K from its beginning to its centre, or R")
        return Path(own=own, begin=begin, end=end, arc=arc, plane=(first, second))

    def _count(self, end_mm: float) -> None:
        low_mm, high_mm = self.correction.range_mm
        self.moves += 1
        self.outside += not low_mm <= end_mm <= high_mm

    def _sent_at_once(self, line: Line, word: Word, end_mm: float) -> str:
        """Return a rapid, or a move from an unknown place, or one to a hole."""
        self._count(end_mm)
        start = self.at[self.modes.axis]
        if start is None:
            self.modes.note(f"{self.modes.axis} comes from an unknown place: taken as forward")
        elif self.modes.motion == "G1":
            self.modes.note("another axis comes from an unknown place: the move is not split")
        self.way = _way(start, end_mm) or self.way or FORWARD
        value = self._send(end_mm)
        self.left.see(self.sent_mm, end_mm, self.way, along=False)
        return line.text[: word.begin] + value + line.text[word.end :]

    def _split(self, line: Line, words: Mapping[str, Word], path: Path, before: Modes) -> list[str]:
        whole = Piece(0.0, 1.0, _way(path.begin[path.own], path.end[path.own]))
        straight_on = path.arc is None and self.way and whole.way in (0, self.way)
        if straight_on and not self.correction.nodes_between(path.begin[path.own], path.end[path.own]):
            pieces, lines = [whole], []
        else:
            pieces = list(self._eased(path))
            lines = self._taken_up(path, pieces[0], before, line)
        if len(pieces) > 1 and (odd := sorted(line.letters - _SPLIT - (set() if path.arc is None else set("IJKR")))):
            raise self.modes.error(f"{odd[0]} in a move that has to be split", "moves of axes alone")
        if len(pieces) + len(lines) > 1 and self.modes.inverse_time:
            raise self.modes.error("a move in inverse time that has to be split", "G94 and a feed")
        if len(pieces) == 1 and path.arc is None:
            word, start = words[path.own], self.sent_mm
            value = self._send(path.end[path.own])
            self._judge(path, pieces[0], start)
            return [*lines, line.text[: word.begin] + value + line.text[word.end :]]
        later = [word for word in line.words if word.letter == "M" and word.value in _AT_END]
        gone = {*path.end, *("IJKR" if path.arc is not None else "")}
        head = replaced(line, gone, {self.modes.motion}, later)
        sent = dict(path.begin)
        for k, piece in enumerate(pieces):
            if k > 0:  # it may turn round within the move
                lines += self._taken_up(path, piece, self.modes, None)
            told = self._piece(path, piece, sent, words)
            lines.append(inserted(head, told) if k == 0 else told)
        return lines + ([" ".join(line.text[word.first : word.end] for word in later)] if later else [])

    def _eased(self, path: Path) -> Iterator[Piece]:
        """Yield the pieces of a move.

        Where the axis turns round and what is commanded does not, as the play is a negative one, the new direction
        has a short piece of its own: twice as long as the play.
        """
        way = self.way
        for whole in path.pieces(self.correction, self.within_mm):
            piece = whole
            step_mm = self._step(path.at(path.own, piece.begin), way, piece.way)
            way = piece.way or way
            if step_mm * piece.way < 0.0:
                places = path.at(path.own, piece.begin), path.at(path.own, piece.end)
                length = min(2.0 * abs(step_mm), abs(places[1] - places[0]))
                share = path.passes(places[0] + piece.way * length, piece.begin, piece.end)
                if piece.begin < share < piece.end:
                    yield Piece(piece.begin, share, piece.way)
                    piece = replace(piece, begin=share)
            yield piece

    def _step(self, place_mm: float, way: int, then: int) -> float:
        """Return by how much what is commanded changes where the axis turns round; 0 where it does not."""
        if way == 0 or then in (0, way):
            return 0.0
        step_mm = self.correction.commanded(place_mm, then) - self.correction.commanded(place_mm, way)
        return step_mm if abs(step_mm) >= self.resolution_mm else 0.0

    def _taken_up(self, path: Path, piece: Piece, modes: Modes, line: Line | None) -> list[str]:
        """Return the line in which the play is taken up before a piece, in the modes of that line."""
        place_mm = path.at(path.own, piece.begin)
        step_mm = self._step(place_mm, self.way, piece.way)
        self.way = piece.way or self.way or FORWARD
        if step_mm * piece.way <= 0.0:
            return []
        feed = None if self.fed or line is None else line.word("F")
        told = "" if feed is None or line is None else f" {line.text[feed.first : feed.end]}"
        return [f"G1 {self.modes.axis}{self._send(place_mm, modes)}{told}"]

    def _piece(self, path: Path, piece: Piece, sent: dict[str, float], words: Mapping[str, Word]) -> str:
        """Return a line of its own for a piece; ``sent``: where the other axes were sent before, and are then."""
        own, start = path.own, self.sent_mm
        begin = {**sent, own: start}
        told = {own: self._send(path.at(own, piece.end))}
        for letter in path.end:
            if letter != own:
                told[letter] = self._other(path, letter, piece, sent, words.get(letter))
        axes = " ".join(f"{letter}{number}" for letter, number in sorted(told.items()))
        if path.arc is None:
            self._judge(path, piece, start)
            return f"G1 {axes}"
        ends = [(places[path.plane[0]], places[path.plane[1]]) for places in (begin, {**sent, own: self.sent_mm})]
        if math.dist(*ends) < _SHORT * self.resolution_mm and abs(path.arc.sweep) * (piece.end - piece.begin) < 1.0:
            self._judge(path, piece, start)
            return f"G1 {axes}"
        centre = path.centre(piece, self.correction, *ends)
        self._judge_arc(path, piece, start, ends, centre)
        names = PLANES[self.modes.plane][2:]
        unit, digits = self.modes.unit_mm, self._digits + 1
        away = [_plain((centre[k] - ends[0][k]) / unit, digits) for k in range(2)]
        return f"{self.modes.motion} {axes} {names[0]}{away[0]} {names[1]}{away[1]}"

    def _other(self, path: Path, letter: str, piece: Piece, sent: dict[str, float], word: Word | None) -> str:
        """Return the number of an axis that is not corrected, at the end of a piece."""
        unit = self.modes.unit_of(letter)
        digits = self._digits if letter in LINEAR else _ROTARY_DIGITS
        if piece.end == 1.0:
            digits, place = digits + _FINER, path.end[letter] / unit
            if self.modes.absolute and word is not None:
                place = word.value
        elif self.modes.absolute:
            place = round(path.at(letter, piece.end) / unit, digits)
        else:
            moved = round((path.at(letter, piece.end) - path.begin[letter]) / unit, digits)
            place = path.begin[letter] / unit + moved
        gone, sent[letter] = sent[letter] / unit, place * unit
        return _plain(place if self.modes.absolute else place - gone, digits + _FINER)

    def _send(self, place_mm: float, modes: Modes | None = None) -> str:
        """Return the number that leads the axis to a place in its direction, and remember what that is in mm."""
        modes = modes or self.modes
        wanted, was = self.correction.commanded(place_mm, self.way), self.sent_mm
        digits = _digits(self.resolution_mm, modes.unit_mm)
        value = wanted if modes.absolute else wanted - was
        told = _plain(value / modes.unit_mm, digits)
        self.sent_mm = float(told) * modes.unit_mm + (0.0 if modes.absolute else was)
        return told

    @property
    def _digits(self) -> int:
        return _digits(self.resolution_mm, self.modes.unit_mm)

    def _judge(self, path: Path, piece: Piece, start_mm: float) -> None:
        """Judge a straight piece along its way and, where it is the last, at its end."""
        begin, end = path.at(path.own, piece.begin), path.at(path.own, piece.end)
        if begin != end:
            for share in (0.25, 0.5, 0.75) if abs(end - begin) > FAR_MM else (0.5,):
                sent = start_mm + share * (self.sent_mm - start_mm)
                wanted = path.at(path.own, piece.begin + share * (piece.end - piece.begin))
                self.left.see(sent, wanted, self.way, along=True)
        if piece.end == 1.0:
            self.left.see(self.sent_mm, end, self.way, along=False)

    def _judge_arc(
        self, path: Path, piece: Piece, start_mm: float, ends: list[tuple[float, float]], centre: tuple[float, float]
    ) -> None:
        """Judge a piece of an arc by how far it is from the circle."""
        angles = [math.atan2(point[1] - centre[1], point[0] - centre[0]) for point in ends]
        sign = 1.0 if self.modes.motion == "G3" else -1.0
        sweep = sign * ((sign * (angles[1] - angles[0])) % (2.0 * math.pi) or 2.0 * math.pi)
        radius = math.dist(ends[0], centre)
        for share in (0.25, 0.5, 0.75):
            angle = angles[0] + share * sweep
            point = centre[0] + radius * math.cos(angle), centre[1] + radius * math.sin(angle)
            there = piece.begin + share * (piece.end - piece.begin)
            if path.bent and path.arc is not None:
                k = path.plane.index(path.own)
                arc = path.arc.centre[k], path.arc.centre[1 - k], path.arc.radius
                self.left.see_on_arc(point[k], point[1 - k], self.way, arc, path.at(path.own, there))
            else:
                sent = start_mm + share * (self.sent_mm - start_mm)
                self.left.see(sent, path.at(path.own, there), self.way, along=True)
        if piece.end == 1.0:
            self.left.see(self.sent_mm, path.end[path.own], self.way, along=False)


def _known(places: Mapping[str, float | None]) -> dict[str, float]:
    return {letter: place for letter, place in places.items() if place is not None}


def _way(begin_mm: float | None, end_mm: float) -> int:
    if begin_mm is None or begin_mm == end_mm:
        return 0
    return FORWARD if end_mm > begin_mm else REVERSE


def _digits(resolution_mm: float, unit_mm: float) -> int:
    """Return how many digits behind the point make steps of at most the resolution."""
    return max(math.ceil(math.log10(unit_mm / resolution_mm) - 1e-9), 0)


def _plain(value: float, digits: int) -> str:
    """Return a number with a point, without zeros behind it, and never as -0."""
    text = f"{value:.{digits}f}".rstrip("0") if digits else f"{value:.0f}."
    return text[1:] if text.startswith("-") and not text.strip("-0.") else text
