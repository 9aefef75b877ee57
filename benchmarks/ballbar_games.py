"""Games of the circle test: errors put into the motion of two axes, and whether `rtec.metrology.ballbar` names them.

The generator knows no shape of the analysis: it moves two axes in time, each with its play, lag, friction and scale,
puts the ball where they are, and takes the length of the bar.
"""

import argparse
import math
import sys
from collections import Counter
from collections.abc import Iterator

import numpy as np

from rtec.metrology.ballbar import analysed, circle_test

AXES = "xy"
CLASSES = (
    "backlash", "reversal spike", "lateral play", "cyclic error", "servo mismatch", "squareness", "scaling mismatch",
    "straightness", "radius change", "vibration", "stick-slip", "master-slave change-over",
)  # fmt: skip
WITHOUT_AXIS = {
    "servo mismatch", "squareness", "scaling mismatch", "radius change", "vibration", "master-slave change-over",
}  # fmt: skip
SIGMAS = 3.0


def names_of(kind: str, draw: np.random.Generator) -> str:
    """Return the name of an error of a class, on an axis that is drawn."""
    return kind if kind in WITHOUT_AXIS else f"{kind} {draw.choice(list(AXES))}"


def play(command: np.ndarray, width: float) -> np.ndarray:
    """Return where a carriage is that a nut with play pushes, shape (samples,); below 0 a step that is too large."""
    if width < 0.0:
        return command - width / 2.0 * np.sign(np.gradient(command))
    place, half = command[0] - math.copysign(width / 2.0, command[1] - command[0]), abs(width) / 2.0
    found = np.empty(command.size)
    for k, at in enumerate(command):
        place = min(max(place, at - half), at + half)
        found[k] = place
    return found


def sticking(command: np.ndarray, jump: float, slow: np.ndarray, draw: np.random.Generator) -> np.ndarray:
    """Return where a carriage is that sticks while it is slow and jumps when it is half a jump behind.

    Between two samples it may have jumped many times.
    """
    place, limit = command[0], jump / 2.0 * draw.uniform(0.7, 1.3)
    found = np.empty(command.size)
    for k in range(command.size):
        at, way = command[k], math.copysign(1.0, command[k] - command[k - 1]) if k else 1.0
        beyond = (at - place) * way - limit
        if not slow[k]:
            place = at
        elif beyond > 0.0:
            limit = jump / 2.0 * draw.uniform(0.7, 1.3)
            place = at + way * (limit - beyond % (2.0 * limit))
        found[k] = place
    return found


def spikes(command: np.ndarray, height: float, width_rad: float, step_rad: float) -> np.ndarray:
    """Return by how much a carriage is off that sticks at each reversal up to a height, then creeps back."""
    found, held = np.zeros(command.size), None
    error = 0.0
    decay = math.exp(-step_rad / width_rad)
    for k in range(2, command.size):
        way, before = command[k] - command[k - 1], command[k - 1] - command[k - 2]
        if way * before < 0.0:
            held = command[k - 1]
        if held is not None:
            error = held - command[k]
            if abs(error) >= height:
                error, held = math.copysign(height, error), None
        else:
            error *= decay
        found[k] = error
    return found


class Game:
    """A machine with errors, and the circle test of it."""

    def __init__(self, names: list[str], seed: int, sigmas: float = SIGMAS) -> None:
        draw = np.random.default_rng(seed)
        self.names = names
        self.radius = float(draw.choice([50.0, 100.0, 150.0, 300.0]))
        self.feed = float(draw.uniform(10.0, 60.0))
        self.points = int(draw.integers(500, 1200))
        self.sigma = float(draw.uniform(0.2, 1.0)) * 1e-3
        self.overshoot = float(draw.uniform(10.0, 45.0))
        self.draw = draw
        several = np.random.default_rng([seed, 9])
        more = [several.uniform(1.0, 5.0 / 3.0) if len(names) > 1 else 1.0 for _ in names]
        self.sizes = {name: times * sigmas * self.sigma for name, times in zip(names, more, strict=True)}
        self.signs = {name: float(draw.choice([-1.0, 1.0])) for name in names}
        self.centre = draw.normal(0.0, 20e-3, 2)
        self.numbers = {name: draw.uniform(0.0, 1.0, 4) for name in names}

    def size(self, name: str) -> float:
        """Return the amplitude of an error in mm with its sign, 0 where the machine has it not."""
        return self.signs[name] * self.sizes[name] if name in self.sizes else 0.0

    def axis(self, letter: str, command: np.ndarray, cross: np.ndarray, step_rad: float, sense: int) -> np.ndarray:
        """Return where an axis is, in mm, shape (samples,)."""
        radius, draw = self.radius, self.draw
        velocity = np.gradient(command)
        place = command
        if name := self.size(f"cyclic error {letter}"):
            period = radius / (2.0 + 18.0 * self.numbers[f"cyclic error {letter}"][0] ** 2)
            place = place + name * np.sin(
                2.0 * np.pi * (command + 7.0 * self.numbers[f"cyclic error {letter}"][1]) / period
            )
        if width := self.size(f"backlash {letter}"):
            place = place - command + play(command, width)
        if jump := abs(self.size(f"stick-slip {letter}")):
            slow = np.abs(velocity) < math.sin(math.radians(20.0)) * np.abs(velocity).max()
            place = place - command + sticking(command, jump, slow, draw)
        if height := abs(self.size(f"reversal spike {letter}")):
            width = math.radians(1.5 + 2.5 * self.numbers[f"reversal spike {letter}"][0])
            place = place + spikes(command, height, width, step_rad)
        scale = self.size("scaling mismatch") / radius
        place = place * (1.0 + (scale if letter == "x" else -scale))
        other = "y" if letter == "x" else "x"
        bow = self.size(f"straightness {other}")
        place = place + bow * ((cross / radius) ** 2 - 0.5)
        lateral = self.size(f"lateral play {other}")
        place = place + lateral / 2.0 * np.sign(np.gradient(cross))
        return place

    def recorded(self) -> dict[str, np.ndarray]:
        """Return angle in deg, deviation in um and sense of both passes."""
        found: dict[str, list[np.ndarray]] = {"angle": [], "deviation": [], "sense": []}
        omega = self.feed / self.radius
        step = 2.0 * np.pi / self.points
        wave = 10.0 + (self.points / 4.0 - 10.0) * self.numbers.get("vibration", np.zeros(4))[0]
        way = self.numbers.get("vibration", np.zeros(4))[1]
        for sense in (1, -1):
            settle = 1.0  # rad before the recording, so that play and friction are in their cycle
            start = -math.radians(self.overshoot)
            turn = np.arange(start - settle, 2.0 * np.pi + math.radians(self.overshoot), step)
            turn = turn + self.draw.uniform(0.0, step)
            time_s = turn / omega
            lag = abs(self.size("servo mismatch")) * 2.0 / self.feed
            lags = (1e-3 + (lag if self.size("servo mismatch") > 0 else 0.0),
                    1e-3 + (lag if self.size("servo mismatch") < 0 else 0.0))  # fmt: skip
            commands = []
            for tau, phase in zip(lags, (0.0, -np.pi / 2.0), strict=True):
                gain = 1.0 / math.hypot(1.0, omega * tau)
                angle = sense * turn - sense * math.atan(omega * tau)
                commands.append(self.radius * gain * np.cos(angle + phase))
            octant = np.floor((sense * turn / (np.pi / 4.0) + 1.0) / 2.0) % 2.0
            leads = self.size("master-slave change-over") / 2.0 * np.where(octant == 0.0, 1.0, -1.0)
            x = self.axis("x", commands[0], commands[1], step, sense)
            y = self.axis("y", commands[1], commands[0], step, sense)
            shear = self.size("squareness") * 2.0 / self.radius
            x = x + shear * y
            if shake := self.size("vibration"):
                shaken = shake * np.sin(wave * omega * time_s + self.draw.uniform(0.0, 6.0))
                if way < 1.0 / 3.0:
                    x = x + shaken
                elif way < 2.0 / 3.0:
                    y = y + shaken
                else:
                    x, y = x + shaken * np.cos(turn), y + sense * shaken * np.sin(turn)
            swell = 1.0 + (leads + self.size("radius change")) / self.radius
            x, y = x * swell + self.centre[0], y * swell + self.centre[1]
            length = np.hypot(x, y) - self.radius + self.draw.normal(0.0, self.sigma, turn.size)
            inside = turn >= start
            found["angle"].append(np.degrees(sense * turn[inside]))
            found["deviation"].append(1e3 * length[inside])
            found["sense"].append(np.full(inside.sum(), float(sense)))
        return {name: np.concatenate(parts) for name, parts in found.items()}

    def answer(self) -> list[str]:
        """Return the names that the analysis gives."""
        data = self.recorded()
        test = circle_test(
            data["angle"], data["deviation"], data["sense"], radius_mm=self.radius, feed_mm_s=self.feed
        )
        return [error.name for error in analysed(test).errors]


def played(names: list[str], seed: int, sigmas: float) -> tuple[set[str], set[str]]:
    """Return which errors of a game are missed, and which names are wrong."""
    answer = set(Game(names, seed, sigmas).answer())
    return set(names) - answer, answer - set(names)


def games(kinds: int, number: int, first_seed: int, sigmas: float, only: list[str] | None = None) -> Iterator[str]:
    """Yield rows of a table: of games with so many classes of errors, how many are right, and what goes wrong."""
    rows = list(CLASSES) if kinds == 1 else [f"{kinds} classes at once" if kinds else "noise alone"]
    for row_number, row in enumerate(rows):
        if only and row not in only:
            continue
        right = named = 0
        notes: Counter[str] = Counter()
        for k in range(number):
            seed = first_seed + 100_000 * kinds + 1000 * row_number + k
            draw = np.random.default_rng([seed, 7])
            chosen = [row] if kinds == 1 else draw.choice(CLASSES, kinds, replace=False).tolist()
            missed, wrong = played(sorted({names_of(kind, draw) for kind in chosen}), seed, sigmas)
            right += not missed and not wrong
            named += bool(wrong)
            notes.update([*(f"{name} missed" for name in missed), *(f"{name} wrong" for name in wrong)])
        texts = ", ".join(f"{name} ({count})" if count > 1 else name for name, count in notes.most_common())
        yield f"| {row} | {right / number:.0%} | {named / number:.0%} | {texts} |"


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--games", type=int, default=100)
    parser.add_argument("--kinds", type=int, nargs="+", default=[1, 2, 3, 0])
    parser.add_argument("--seed", type=int, default=50_000)
    parser.add_argument("--sigmas", type=float, default=SIGMAS)
    parser.add_argument("--only", nargs="+", help="rows of the table")
    words = parser.parse_args()
    sys.stdout.write("| errors | right | with a wrong name | what |\n|---|---|---|---|\n")
    for kinds in words.kinds:
        for line in games(kinds, words.games, words.seed, words.sigmas, words.only):
            sys.stdout.write(f"{line}\n")
            sys.stdout.flush()
