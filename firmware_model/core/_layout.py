"""Where the processor's state lies: constants shared by the kernels and the face.

All bytes are in one array ``m``, so that a direct operand is one index: internal RAM at 0..255, pins at 256..259, the
special function registers at 256 + their direct address, external RAM behind. What the programmer cannot see is in
one int64 array ``h``.
"""

from __future__ import annotations

# bytes
PINS = 256
SFR_BASE = 256
XRAM = 512
SNAPSHOT = XRAM + 65536
"""Where the loop keeps what internal RAM, pins and registers held one turn of a waiting loop before."""

BYTES = SNAPSHOT + 512

P0, SP, DPL, DPH, PCON = 0x180, 0x181, 0x182, 0x183, 0x187
TCON, TMOD, TL0, TL1, TH0, TH1 = 0x188, 0x189, 0x18A, 0x18B, 0x18C, 0x18D
P1, SCON, SBUF, P2, IE, P3, IP = 0x190, 0x198, 0x199, 0x1A0, 0x1A8, 0x1B0, 0x1B8
T2CON, RCAP2L, RCAP2H, TL2, TH2 = 0x1C8, 0x1CA, 0x1CB, 0x1CC, 0x1CD
NOT_PORT = 0x1CF
"""Bits of a place that tell the four ports, 0x180 to 0x1B0, from all others."""

PSW, ACC, B = 0x1D0, 0x1E0, 0x1F0

# the decoded word of an address (int64)
COST_AT, TAKEN_AT, LENGTH_AT, N_AT, SPECIAL_AT, X_AT, Y_AT, BIT_AT, BACK_AT = 9, 14, 17, 19, 22, 24, 40, 49, 52
SPECIAL = 1 << SPECIAL_AT
BACK = 1 << BACK_AT
"""Set in the word of a branch that leads a few bytes back, as in a loop that waits."""

OUTSIDE_IMAGE, UNMAPPED_SFR = 0x100, 0x101
RESERVED = 0xA5

# hidden state (int64)
(
    PC,
    CYCLES,
    COUNT,
    DUE,  # cycle at which the loop must look up from executing
    END,  # cycle at which the run ends
    TOP,  # highest address of internal RAM
    TICK,  # cycles of a timer increment
    RECOGNISE,  # cycles between the end of the cycle of a request and the earliest call
    CALL,  # cycles of the hardware's call
    HAS_TIMER2,
    SYNCED,  # cycle up to which timers and serial port have been brought
    SERVING,  # bit 0: low priority in service, bit 1: high
    HOLD,  # no interrupt at the boundary that follows
    STOP,  # why the loop must end
    FAULT,
    LEVELS,  # P3 + 256 * P1 as they stand at the pins
    LEVELS_AT,  # since which cycle
    SEEN,  # the same as last sampled
    OVERFLOWS_1,  # of timer 1 since reset: the free-running divider of the serial port
    OVERFLOWS_2,
    SEND_LEFT,  # overflows until TI; 0 where nothing is sent
    SEND_AT,  # or the cycle of TI, in the modes with a fixed rate
    SEND_BYTE,
    RECEIVE_LEFT,
    RECEIVE_AT,
    RECEIVE_BYTE,  # nine bits
    CHANGE,  # index of the next change of pins
    CHANGES,  # how many there are
    LOGGED,
    LOG_ROOM,
    STAMP,  # six: the cycle at whose end each request came
) = range(31)
WATCHED = STAMP + 6  # four: the bits of each port whose change the loop must not miss
INPUTS = WATCHED + 4  # four: the bits of each port that a timer or an interrupt looks at
OTHERS = INPUTS + 4  # what DUE would be without END and without changes of pins
STOPPING = OTHERS + 1  # four: the bits of each port at whose change the run stops
OUTPUT_AT = STOPPING + 4  # the cycle of that change
BUS = OUTPUT_AT + 1  # 1: the run stops before each read of external memory; 2: the byte is there, go on
BUS_AT = BUS + 1  # the address of that read
TOUCHED = BUS_AT + 1  # 1: something has been read or written that a comparison of two snapshots does not show
TURN_CYCLES = TOUCHED + 1  # when the snapshot was taken, and how many instructions had been executed then
TURN_COUNT = TURN_CYCLES + 1
DROPPED = TURN_COUNT + 1  # two: the cycle at whose end the level of INT0 or INT1 was gone
QUIET = DROPPED + 2  # until this cycle no flag changes by itself
HIDDEN = QUIET + 1

# requests in polling order; their vector is 8 * index + 3
EXTERNAL_0, TIMER_0, EXTERNAL_1, TIMER_1, SERIAL, TIMER_2 = range(6)

RUNNING, STOP_FAULT, STOP_POWER_DOWN, STOP_LOG_FULL, STOP_OUTPUT, STOP_BUS = range(6)
FAULT_NONE, FAULT_RESERVED, FAULT_UNMAPPED, FAULT_OUTSIDE, FAULT_STACK, FAULT_INDIRECT = range(6)

NEVER = 2**62

# rows of the log: cycle, what, value
LOG_COLUMNS = 3
LOG_SERIAL = 4  # 0..3 are the ports
