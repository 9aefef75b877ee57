"""Plain models of the two sides of the handshake, from the words of NISTIR 4832, "General Considerations".

Nothing here imports rtec.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import floor


@dataclass
class BoxWords:
    """What the box decides about each reading of the request."""

    window: int = 3
    grace: int = 2
    switch_on: bool = True
    homed: bool = False
    held: bool = False
    home: int = 0
    accepted: int = 0
    completed: int = 0
    in_doubt: int = 0
    refused: int = 0
    status: str = "NOT_HOMED"

    def command_home(self, count: int) -> None:
        if not self.homed:
            self.homed, self.home, self.accepted, self.status = True, count, self.completed, "OK"

    def read(self, total: int, *, large: bool = False, probing: bool = False) -> None:
        if not self.homed or self.held:
            return
        if probing:
            self.status = "PROBING"
            return
        if not self.switch_on:
            # "an error message is sent if a nonzero Correction Requested is received while they are disabled"
            self.status = "DISABLED" if total else "OK"
            return
        if large or abs(total - self.accepted) <= self.window:
            self.accepted, self.in_doubt, self.status = total, 0, "OK"
            return
        self.refused += 1
        self.in_doubt += 1
        # the first doubt, and the next two readings; "otherwise the RTEC will issue a fatal error message"
        self.held = self.in_doubt > self.grace
        self.status = "I_STILL_DONT_BELIEVE_YOU" if self.held else "I_DONT_BELIEVE_YOU"


@dataclass
class PcWords:
    """What the PC asks for after each look at the box's words."""

    window: int
    limit: int
    step_mm: float
    count_mm: float
    reversal_mm: float
    margin: float
    state: str = "WAITING"
    direction: int = 1
    furthest: int = 0
    target: int = 0
    sent: int = 0
    large_meant: bool = False
    flag_up: bool = False
    probing: bool = False
    beyond: int = 0
    flags: set[str] = field(default_factory=set)

    def turn(self, position: int, accepted: int, status: str, deviation_mm: float) -> None:
        lost_home = self.state == "ACTIVE" and status == "NOT_HOMED"
        if status == "I_STILL_DONT_BELIEVE_YOU" or lost_home:
            self.state = "HOLD"
            return
        if self.state == "WAITING" and status != "NOT_HOMED" and position == 0:
            self.state, self.furthest, self.sent = "ACTIVE", 0, accepted
        if self.state != "ACTIVE":
            return
        self.follow(position)
        wanted = deviation_mm / self.step_mm
        if abs(wanted - self.target) > 0.5 + self.margin:
            self.target = floor(wanted + 0.5)
        goal = max(-self.limit, min(self.limit, self.target))
        self.beyond = abs(self.target - goal)
        self.flags = {"probing"} if self.probing else set()
        free = accepted == self.sent and status == "OK"
        astray = status == "I_DONT_BELIEVE_YOU" and abs(self.sent - accepted) > self.window and not self.flag_up
        if not self.probing and (free or astray):
            if self.large_meant:
                self.sent = goal
                if abs(goal - accepted) > self.window:
                    self.flags.add("large")
                self.large_meant = False
            else:
                self.sent = max(accepted - self.window, min(accepted + self.window, goal))
        elif accepted != self.sent and self.flag_up:
            self.flags.add("large")
        self.flag_up = "large" in self.flags

    def follow(self, position: int) -> None:
        """Turn with the motion once it has come back by more than the hysteresis."""
        if (position - self.furthest) * self.direction >= 0:
            self.furthest = position
        elif abs(position - self.furthest) * self.count_mm > self.reversal_mm:
            self.direction = -self.direction
            self.furthest = position
