"""Compiled model of the bus: arbitration by identifier, the time that a frame takes, what can go wrong on the way.

A frame of eight bytes takes up to 135 bits by the usual bound: 111 with the gap to the next one, and a stuff bit
after each four of 97 (no frame reaches more than 133). The model always takes that long. Frames of a node leave in
the order in which it wants to send them; between nodes the lowest identifier wins. At the end of a frame every other
node has it: :func:`bus_step` says which frame, from whom.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rtec._jit import Record, helper, kernel
from rtec.link._crc_kernels import sealed
from rtec.link._frame_kernels import AXIS_BITS, REQUEST
from rtec.link._outbox_kernels import OUTBOX
from rtec.signal._kernels import NEVER

FRAME_BITS = 135
NODES = 8
DELAYED = 16

BABBLER = NODES
"""A node outside rtec."""

SHORT_SHIFT = 32
"""A frame of fewer than 8 bytes carries in its identifier, from this bit on, how many are missing."""
EXTENDED = 1 << 36
"""Set in the identifier of a frame in the extended format."""

NO_FAULT = 0
# what can happen to a frame; the node that sent it, or all nodes, is the place
LOST, LATE, DUPLICATED, REORDERED, CORRUPTED = 1, 2, 3, 4, 5
MASQUERADE, FLIPPED, STUCK, BABBLING, OFF = 6, 7, 8, 9, 10
LAST_OF_BUS = OFF

ANY = -1

BEGUN, FRAMES_AFFECTED, CABLE_AFFECTED, WORD_AFFECTED, GLITCHES_MADE, TWIN_DIFFERS, EDGES_KEPT = 0, 1, 2, 3, 4, 5, 6
"""What shows that a fault was activated: that it began, or what it affected."""

FAULT = np.dtype(
    [
        # parameters
        ("kind", np.int64),
        ("place", np.int64),  # node that sends the frames, or axis of a fault beyond the bus; ANY
        ("identifier", np.int64),  # of the frames it affects; ANY
        ("from_ps", np.int64),
        ("until_ps", np.int64),
        ("most", np.int64),  # frames it affects
        ("delay_ps", np.int64),
        ("seed", np.int64),
        ("activation", np.int64),  # what shows that it took effect
        ("while_inserting", np.int64),  # 1: it waits for an insertion to be under way
        ("cable", np.int64),  # which levels it changes on the lines before the box
        ("glitch_level", np.int64),  # as in the encoder's record
        ("glitch_ps", np.int64),
        # state
        ("kept_node", np.int64),
        ("kept_identifier", np.int64),
        ("kept_payload", np.int64),
        ("kept", np.int64),
        ("ended", np.int64),
        ("effects_before", np.int64),  # effects of this kind at its axis before it began
        # observations
        ("fired", np.int64),  # times that it took effect
        ("fired_ps", np.int64),  # when that was first noted
    ],
    align=True,
)

BUS = np.dtype(
    [
        # parameters
        ("bit_ps", np.int64),
        # state
        ("queues", OUTBOX, (NODES,)),
        ("sending", np.int64),  # node whose frame is on the wires, or -1
        ("sending_identifier", np.int64),
        ("sending_payload", np.int64),
        ("ends_ps", np.int64),  # of the frame on the wires; NEVER: the bus is idle
        ("delayed", np.int64),
        ("delayed_ps", np.int64, (DELAYED,)),
        ("delayed_identifier", np.int64, (DELAYED,)),
        ("delayed_payload", np.int64, (DELAYED,)),
        ("delayed_node", np.int64, (DELAYED,)),
        # the frame delivered last
        ("node", np.int64),
        ("identifier", np.int64),
        ("payload", np.int64),
        # observations
        ("frames", np.int64),
        ("busy_ps", np.int64),
        ("overrun", np.int64),
    ],
    align=True,
)


@helper
def bits_of(seed: int, serial: int) -> int:
    """Return 62 random bits for the frame number ``serial`` that a fault affects."""
    z = np.uint64(serial + 1) * np.uint64(0x9E3779B97F4A7C15) + np.uint64(seed) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(31))) * np.uint64(0x94D049BB133111EB)
    return int((z ^ (z >> np.uint64(29))) >> np.uint64(2))


@helper
def rank(identifier: int) -> int:
    """Return the arbitration number of a frame: of equal first 11 bits, the base format wins."""
    if identifier & EXTENDED:
        return 2 * (identifier & 0x1FFFFFFF) + 1
    return (identifier & 0x7FF) << 19


@helper
def fire(f: Record, t_ps: int) -> None:
    """Note that a fault took effect."""
    if f.fired == 0:
        f.fired_ps = t_ps
    f.fired += 1


@helper
def affects(f: Record, t_ps: int, node: int, identifier: int) -> bool:
    """Return whether a fault affects this frame."""
    if not f.from_ps <= t_ps < f.until_ps or f.fired >= f.most:
        return False
    return bool((f.place == ANY or f.place == node) and (f.identifier == ANY or f.identifier == identifier))


@helper
def is_off(faults: NDArray[np.void], node: int, t_ps: int) -> bool:
    """Return whether a node is off the bus."""
    for i in range(faults.size):
        f = faults[i]
        if f.kind == OFF and f.place == node and f.from_ps <= t_ps < f.until_ps:
            return True
    return False


@helper
def next_sender(bus: Record, faults: NDArray[np.void], t_ps: int) -> int:
    """Return the node that begins at ``t_ps``: a babbler, else that with the lowest identifier; -1 for nobody."""
    winner = -1
    for i in range(faults.size):
        f = faults[i]
        if f.kind == BABBLING and f.from_ps <= t_ps < f.until_ps:
            winner = BABBLER
            fire(f, t_ps)
        elif f.kind == OFF and 0 <= f.place < NODES and f.from_ps <= t_ps < f.until_ps:
            queue = bus.queues[f.place]
            if queue.waiting > 0:  # a node that goes off drops the frames that it had queued
                queue.waiting = 0
                fire(f, t_ps)
    if winner != BABBLER:
        lowest = 1 << 30
        for node in range(NODES):
            queue = bus.queues[node]
            if queue.waiting > 0 and rank(queue.identifier[0]) < lowest:
                winner = node
                lowest = rank(queue.identifier[0])
    return winner


@helper
def bus_begin(bus: Record, faults: NDArray[np.void], t_ps: int) -> None:
    """Let the node with the lowest identifier begin, if the bus is idle and a frame is waiting."""
    if bus.ends_ps != NEVER:
        return
    winner = next_sender(bus, faults, t_ps)
    if winner == -1:
        return
    bus.sending = winner
    bus.sending_identifier = 0
    bus.sending_payload = 0
    if winner != BABBLER:
        queue = bus.queues[winner]
        bus.sending_identifier = queue.identifier[0]
        bus.sending_payload = queue.payload[0]
        queue.waiting -= 1
        for k in range(queue.waiting):
            queue.identifier[k] = queue.identifier[k + 1]
            queue.payload[k] = queue.payload[k + 1]
    bus.ends_ps = t_ps + FRAME_BITS * bus.bit_ps
    bus.frames += 1
    bus.busy_ps += FRAME_BITS * bus.bit_ps


@kernel
def bus_submit(bus: Record, faults: NDArray[np.void], node: int, t_ps: int, identifier: int, payload: int) -> None:
    """Let a node want to send a frame at ``t_ps``."""
    for i in range(faults.size):
        f = faults[i]
        if f.kind == OFF and f.place == node and f.from_ps <= t_ps < f.until_ps:
            fire(f, t_ps)
            return
        if f.kind == STUCK and affects(f, t_ps, node, identifier):
            # the sender's buffer is not written any more: the first frame goes out again and again
            if f.kept == 0:
                f.kept = 1
                f.kept_identifier = identifier
                f.kept_payload = payload
            elif identifier == f.kept_identifier:
                fire(f, t_ps)
                payload = f.kept_payload
    queue = bus.queues[node]
    if queue.waiting == queue.identifier.size:
        bus.overrun += 1
        return
    queue.identifier[queue.waiting] = identifier
    queue.payload[queue.waiting] = payload
    queue.waiting += 1
    bus_begin(bus, faults, t_ps)


@helper
def bus_next(bus: Record) -> int:
    """Return when the bus next delivers a frame."""
    t_ps = bus.ends_ps
    for k in range(bus.delayed):
        t_ps = min(t_ps, bus.delayed_ps[k])
    return int(t_ps)


@helper
def delay(bus: Record, due_ps: int, node: int, identifier: int, payload: int) -> None:
    """Deliver a frame later."""
    if bus.delayed == DELAYED:
        bus.overrun += 1
        return
    k = bus.delayed
    bus.delayed_ps[k] = due_ps
    bus.delayed_identifier[k] = identifier
    bus.delayed_payload[k] = payload
    bus.delayed_node[k] = node
    bus.delayed += 1


@helper
def corrupted(f: Record, payload: int) -> int:
    """Return the payload with one to three bits flipped, the checksum as it was."""
    bits = bits_of(f.seed, f.fired)
    flipped = np.int64(0)
    for k in range(1 + bits % 3):
        place = np.int64((bits >> (8 + 6 * k)) & 63)
        while (flipped >> place) & 1:  # a bit that is flipped twice is right again
            place = (place + 1) & 63
        flipped |= np.int64(1) << place
    return int(payload ^ flipped)


@helper
def miscounted(f: Record, identifier: int, payload: int) -> int:
    """Return a request with one bit of its total flipped under a right checksum; MASQUERADE flips its inverse."""
    bit = 16 + bits_of(f.seed, f.fired) % 8
    payload ^= 1 << bit
    if f.kind == MASQUERADE:
        payload ^= 1 << (bit + 16)
    return sealed(identifier, payload)


@helper
def masquerade(f: Record, identifier: int, payload: int) -> int:
    """Return another frame than a request with one bit of its contents flipped, under a right checksum."""
    return sealed(identifier, payload ^ (1 << (16 + bits_of(f.seed, f.fired) % 48)))


@helper
def take_off(  # noqa: C901 - what happens to a frame is one table
    bus: Record, faults: NDArray[np.void], t_ps: int
) -> bool:
    """End the frame on the wires and apply the faults to it; return whether it is delivered now."""
    node, identifier, payload = bus.sending, bus.sending_identifier, bus.sending_payload
    bus.sending = -1
    bus.ends_ps = NEVER
    if node == BABBLER:
        return False  # its frames are not delivered, and no fault of another kind is activated by them
    delivered = True
    for i in range(faults.size):
        f = faults[i]
        if not LOST <= f.kind <= FLIPPED:
            continue
        if f.kind == REORDERED and f.kept == 1 and node == f.kept_node and identifier == f.kept_identifier:
            delay(bus, t_ps + 1, node, f.kept_identifier, f.kept_payload)  # right behind the frame it should precede
            f.kept = 0
            fire(f, t_ps)
            continue
        if not delivered or not affects(f, t_ps, node, identifier):
            continue
        if f.kind == LOST:
            delivered = False
            fire(f, t_ps)
        elif f.kind == LATE:
            delay(bus, t_ps + f.delay_ps, node, identifier, payload)
            delivered = False
            fire(f, t_ps)
        elif f.kind == DUPLICATED:
            delay(bus, t_ps + f.delay_ps, node, identifier, payload)
            fire(f, t_ps)
        elif f.kind == REORDERED:
            if f.kept == 0:
                f.kept = 1
                f.kept_node = node
                f.kept_identifier = identifier
                f.kept_payload = payload
                delivered = False
        elif identifier >> SHORT_SHIFT:
            continue  # not one of our messages
        elif f.kind == CORRUPTED:
            payload = corrupted(f, payload)
            fire(f, t_ps)
        elif identifier & ~AXIS_BITS == REQUEST:
            payload = miscounted(f, identifier, payload)
            fire(f, t_ps)
        elif f.kind == MASQUERADE:
            payload = masquerade(f, identifier, payload)
            fire(f, t_ps)
    bus.node = node
    bus.identifier = identifier
    bus.payload = payload
    return delivered


@helper
def bus_step(bus: Record, faults: NDArray[np.void]) -> bool:
    """Carry out the next event; return whether ``node``, ``identifier`` and ``payload`` tell a frame delivered."""
    t_ps = bus_next(bus)
    if bus.ends_ps == t_ps:
        delivered = take_off(bus, faults, t_ps)
        bus_begin(bus, faults, t_ps)
        return delivered
    first = 0
    for k in range(1, bus.delayed):
        if bus.delayed_ps[k] < bus.delayed_ps[first]:
            first = k
    bus.node = bus.delayed_node[first]
    bus.identifier = bus.delayed_identifier[first]
    bus.payload = bus.delayed_payload[first]
    bus.delayed -= 1
    for k in range(first, bus.delayed):
        bus.delayed_ps[k] = bus.delayed_ps[k + 1]
        bus.delayed_identifier[k] = bus.delayed_identifier[k + 1]
        bus.delayed_payload[k] = bus.delayed_payload[k + 1]
        bus.delayed_node[k] = bus.delayed_node[k + 1]
    return True


@kernel
def bus_reset(bus: Record, bit_ps: int) -> None:
    """Start with an idle bus."""
    bus.bit_ps = bit_ps
    bus.sending = -1
    bus.ends_ps = NEVER
    bus.delayed = 0
    for node in range(NODES):
        bus.queues[node].waiting = 0


@kernel
def next_delivery(bus: Record, faults: NDArray[np.void], before_ps: int) -> int:
    """Run the bus up to its next delivery before ``before_ps``; return its time, or NEVER."""
    while True:
        t_ps = bus_next(bus)
        if t_ps >= before_ps:
            return NEVER
        if bus_step(bus, faults) and not is_off(faults, bus.node, t_ps):
            return t_ps
