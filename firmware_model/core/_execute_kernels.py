"""The loop that executes instructions: fetch a decoded word, jump on its form, until something is due.

Program counter and cycles are local; all else that an instruction can change lies in the array ``m``. Timers and
interrupts are not looked at between instructions but at the cycle ``DUE``, set to 0 by every write that could change
it.
The numbers compared are first opcodes of forms (`firmware_model.isa.table`); the compiler makes one jump of them.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from firmware_model._jit import helper, kernel, step
from firmware_model.core import _layout as at
from firmware_model.core._arithmetic_kernels import (
    add,
    carry,
    decimal_adjust,
    divide,
    multiply,
    set_carry,
    subtract,
)
from firmware_model.core._interrupt_kernels import attend
from firmware_model.core._pin_kernels import move_pins, pins_alone, refresh
from firmware_model.core._register_kernels import latch, parity, write, write_port
from firmware_model.core._request_kernels import Bytes, Hidden, Log, byte
from firmware_model.core._waiting_kernels import TURNS_BEFORE, TURNS_BETWEEN, keep_turn, turns_to_skip


@step
def bank(m: Bytes) -> int:
    """Return the address of R0 in the register bank selected by RS1 and RS0."""
    return byte(m, at.PSW) & 0x18


@step
def get(m: Bytes, h: Hidden, log: Log, w: int, place: int, cycles: int) -> int:
    """Read a direct operand as it stands when the instruction begins."""
    if w & at.SPECIAL != 0:
        if place & at.NOT_PORT == at.P0:  # the hot case of firmware that watches its pins
            return byte(m, place) & byte(m, at.PINS + ((place - at.P0) >> 4))
        if place == at.TCON and cycles < h[at.QUIET]:
            return byte(m, place)
        return latch(m, h, log, place, cycles)
    return byte(m, place)


@step
def hold(m: Bytes, h: Hidden, log: Log, w: int, place: int, now: int) -> int:
    """Read a direct operand for a read-modify-write instruction, which takes the latch of a port."""
    if w & at.SPECIAL != 0 and place & at.NOT_PORT != at.P0:
        return latch(m, h, log, place, now)
    return byte(m, place)


@step
def put(m: Bytes, h: Hidden, log: Log, w: int, place: int, value: int, now: int) -> None:
    """Write a direct operand at the end of the instruction."""
    if w & at.SPECIAL != 0 and place != at.PSW and place >= 256:
        if place & at.NOT_PORT == at.P0:
            if (byte(m, place) ^ value) & h[at.WATCHED + ((place - at.P0) >> 4)] != 0:
                write_port(m, h, log, place, value, now)
            else:
                m[place] = value
        else:
            write(m, h, log, place, value, now)
    else:
        m[place] = value


@step
def bus_waits(h: Hidden, address: int) -> bool:
    """Stop before a read of external memory where something answers it; the second time the byte is there."""
    if h[at.BUS] == 0:
        return False
    h[at.TOUCHED] = 1
    if h[at.BUS] == 1:
        h[at.BUS_AT] = address
        h[at.STOP] = at.STOP_BUS
        h[at.DUE] = 0
        return True
    h[at.BUS] = 1
    return False


@step
def dptr(m: Bytes) -> int:
    """Return the data pointer."""
    return (byte(m, at.DPH) << 8) | byte(m, at.DPL)


@helper
def external(m: Bytes, h: Hidden, log: Log, now: int) -> None:
    """Leave 0FFH in the latch of P0, as every access to external memory does ("Accessing External Memory")."""
    if m[at.P0] != 255:
        write_port(m, h, log, at.P0, 255, now)


@kernel
def execute(  # noqa: C901 - one instruction set is one table
    words: NDArray[np.int64], code: Bytes, m: Bytes, h: Hidden, log: Log, changes: NDArray[np.int64]
) -> None:
    """Execute from PC until END or until STOP says why not; counts and faults are left in ``h``."""
    pc, cycles, executed = int(h[at.PC]), int(h[at.CYCLES]), int(h[at.COUNT])
    top = int(h[at.TOP])
    kind = at.FAULT_NONE
    turn_pc, turns = -1, 0
    while True:
        if cycles >= h[at.DUE]:
            turns = 0
            if cycles >= h[at.END] or h[at.STOP] != 0:
                break
            if pins_alone(m, h, log, changes, cycles):
                continue
            h[at.PC] = pc
            cycles = attend(m, h, log, changes, cycles)
            pc = int(h[at.PC])
            if h[at.STOP] != 0:
                break
            continue
        w = int(words[pc])
        op = w & 0x1FF
        now = cycles + ((w >> at.COST_AT) & 31)
        taken = now + ((w >> at.TAKEN_AT) & 7)
        after = (pc + ((w >> at.LENGTH_AT) & 3)) & 0xFFFF
        n = (w >> at.N_AT) & 7
        x = (w >> at.X_AT) & 0xFFFF
        y = (w >> at.Y_AT) & 0x1FF
        if op == 0x00:  # NOP
            pass
        elif op in (0x01, 0x02, 0x80):  # AJMP addr11, LJMP addr16, SJMP rel
            after = x
        elif op == 0x73:  # JMP @A+DPTR
            after = (byte(m, at.ACC) + dptr(m)) & 0xFFFF
        elif op in (0x11, 0x12):  # ACALL addr11, LCALL addr16
            p = byte(m, at.SP) + 2
            if p > top:
                kind = at.FAULT_STACK
                break
            m[p - 1] = after & 255
            m[p] = after >> 8
            m[at.SP] = p
            after = x
        elif op in (0x22, 0x32):  # RET, RETI
            p = byte(m, at.SP)
            if p > top or (p - 1) & 255 > top:
                kind = at.FAULT_STACK
                break
            after = (byte(m, p) << 8) | byte(m, (p - 1) & 255)
            m[at.SP] = (p - 2) & 255
            if op == 0x32:
                h[at.SERVING] &= 1 if h[at.SERVING] & 2 != 0 else 0
                h[at.HOLD] = 1
                h[at.DUE] = 0
        elif op == 0x40:  # JC rel
            if carry(m) != 0:
                after = x
                now = taken
        elif op == 0x50:  # JNC rel
            if carry(m) == 0:
                after = x
                now = taken
        elif op == 0x60:  # JZ rel
            if m[at.ACC] == 0:
                after = x
                now = taken
        elif op == 0x70:  # JNZ rel
            if m[at.ACC] != 0:
                after = x
                now = taken
        elif op == 0x20:  # JB bit,rel
            if get(m, h, log, w, y, cycles) & (1 << ((w >> at.BIT_AT) & 7)) != 0:
                after = x
                now = taken
        elif op == 0x30:  # JNB bit,rel
            if get(m, h, log, w, y, cycles) & (1 << ((w >> at.BIT_AT) & 7)) == 0:
                after = x
                now = taken
        elif op == 0x10:  # JBC bit,rel
            value = hold(m, h, log, w, y, now)
            mask = 1 << ((w >> at.BIT_AT) & 7)
            if value & mask != 0:
                put(m, h, log, w, y, value & ~mask, now)
                after = x
                now = taken
        elif op == 0xB4:  # CJNE A,#data,rel
            value = byte(m, at.ACC)
            set_carry(m, 1 if value < y else 0)
            if value != y:
                after = x
                now = taken
        elif op == 0xB5:  # CJNE A,direct,rel
            value = byte(m, at.ACC)
            other = get(m, h, log, w, y, cycles)
            set_carry(m, 1 if value < other else 0)
            if value != other:
                after = x
                now = taken
        elif op == 0xB6:  # CJNE @Ri,#data,rel
            p = byte(m, bank(m) | n)
            if p > top:
                kind = at.FAULT_INDIRECT
                break
            value = byte(m, p)
            set_carry(m, 1 if value < y else 0)
            if value != y:
                after = x
                now = taken
        elif op == 0xB8:  # CJNE Rn,#data,rel
            value = byte(m, bank(m) | n)
            set_carry(m, 1 if value < y else 0)
            if value != y:
                after = x
                now = taken
        elif op == 0xD5:  # DJNZ direct,rel
            value = (hold(m, h, log, w, y, now) - 1) & 255
            put(m, h, log, w, y, value, now)
            if value != 0:
                after = x
                now = taken
        elif op == 0xD8:  # DJNZ Rn,rel
            p = bank(m) | n
            value = (byte(m, p) - 1) & 255
            m[p] = value
            if value != 0:
                after = x
                now = taken
        elif op == 0x03:  # RR A
            value = byte(m, at.ACC)
            m[at.ACC] = (value >> 1) | ((value & 1) << 7)
        elif op == 0x13:  # RRC A
            value = byte(m, at.ACC)
            m[at.ACC] = (value >> 1) | (carry(m) << 7)
            set_carry(m, value & 1)
        elif op == 0x23:  # RL A
            value = byte(m, at.ACC)
            m[at.ACC] = ((value << 1) & 255) | (value >> 7)
        elif op == 0x33:  # RLC A
            value = byte(m, at.ACC)
            m[at.ACC] = ((value << 1) & 255) | carry(m)
            set_carry(m, value >> 7)
        elif op == 0xC4:  # SWAP A
            value = byte(m, at.ACC)
            m[at.ACC] = (value >> 4) | ((value & 15) << 4)
        elif op == 0xE4:  # CLR A
            m[at.ACC] = 0
        elif op == 0xF4:  # CPL A
            m[at.ACC] = byte(m, at.ACC) ^ 255
        elif op == 0xD4:  # DA A
            decimal_adjust(m)
        elif op == 0xA4:  # MUL AB
            multiply(m)
        elif op == 0x84:  # DIV AB
            divide(m)
        elif op == 0xA3:  # INC DPTR
            p = (dptr(m) + 1) & 0xFFFF
            m[at.DPL] = p & 255
            m[at.DPH] = p >> 8
        elif op == 0x90:  # MOV DPTR,#data16
            m[at.DPL] = x & 255
            m[at.DPH] = x >> 8
        elif op == 0x74:  # MOV A,#data
            m[at.ACC] = y
        elif op == 0xE5:  # MOV A,direct
            m[at.ACC] = get(m, h, log, w, y, cycles)
        elif op == 0xE6:  # MOV A,@Ri
            p = byte(m, bank(m) | n)
            if p > top:
                kind = at.FAULT_INDIRECT
                break
            m[at.ACC] = m[p]
        elif op == 0xE8:  # MOV A,Rn
            m[at.ACC] = m[bank(m) | n]
        elif op == 0x75:  # MOV direct,#data
            put(m, h, log, w, y, x, now)
        elif op == 0xF5:  # MOV direct,A
            put(m, h, log, w, y, byte(m, at.ACC), now)
        elif op == 0x85:  # MOV direct,direct
            value = get(m, h, log, w, y, cycles) if y >= 256 else byte(m, y)
            put(m, h, log, w, x, value, now)
        elif op == 0x86:  # MOV direct,@Ri
            p = byte(m, bank(m) | n)
            if p > top:
                kind = at.FAULT_INDIRECT
                break
            put(m, h, log, w, y, byte(m, p), now)
        elif op == 0x88:  # MOV direct,Rn
            put(m, h, log, w, y, byte(m, bank(m) | n), now)
        elif op == 0x76:  # MOV @Ri,#data
            p = byte(m, bank(m) | n)
            if p > top:
                kind = at.FAULT_INDIRECT
                break
            m[p] = y
        elif op == 0xF6:  # MOV @Ri,A
            p = byte(m, bank(m) | n)
            if p > top:
                kind = at.FAULT_INDIRECT
                break
            m[p] = m[at.ACC]
        elif op == 0xA6:  # MOV @Ri,direct
            p = byte(m, bank(m) | n)
            if p > top:
                kind = at.FAULT_INDIRECT
                break
            m[p] = get(m, h, log, w, y, cycles)
        elif op == 0x78:  # MOV Rn,#data
            m[bank(m) | n] = y
        elif op == 0xF8:  # MOV Rn,A
            m[bank(m) | n] = m[at.ACC]
        elif op == 0xA8:  # MOV Rn,direct
            m[bank(m) | n] = get(m, h, log, w, y, cycles)
        elif op == 0xC5:  # XCH A,direct
            value = get(m, h, log, w, y, cycles)
            other = byte(m, at.ACC)
            m[at.ACC] = value
            put(m, h, log, w, y, other, now)
        elif op == 0xC6:  # XCH A,@Ri
            p = byte(m, bank(m) | n)
            if p > top:
                kind = at.FAULT_INDIRECT
                break
            value = byte(m, p)
            m[p] = m[at.ACC]
            m[at.ACC] = value
        elif op == 0xC8:  # XCH A,Rn
            p = bank(m) | n
            value = byte(m, p)
            m[p] = m[at.ACC]
            m[at.ACC] = value
        elif op == 0xD6:  # XCHD A,@Ri
            p = byte(m, bank(m) | n)
            if p > top:
                kind = at.FAULT_INDIRECT
                break
            value = byte(m, p)
            other = byte(m, at.ACC)
            m[p] = (value & 0xF0) | (other & 15)
            m[at.ACC] = (other & 0xF0) | (value & 15)
        elif op == 0xC0:  # PUSH direct
            p = byte(m, at.SP) + 1
            if p > top:
                kind = at.FAULT_STACK
                break
            m[at.SP] = p
            m[p] = get(m, h, log, w, y, cycles)
        elif op == 0xD0:  # POP direct
            p = byte(m, at.SP)
            if p > top:
                kind = at.FAULT_STACK
                break
            m[at.SP] = (p - 1) & 255
            put(m, h, log, w, y, byte(m, p), now)
        elif op == 0x83:  # MOVC A,@A+PC
            m[at.ACC] = code[(byte(m, at.ACC) + after) & 0xFFFF]
        elif op == 0x93:  # MOVC A,@A+DPTR
            m[at.ACC] = code[(byte(m, at.ACC) + dptr(m)) & 0xFFFF]
        elif op == 0xE0:  # MOVX A,@DPTR
            p = dptr(m)
            if bus_waits(h, p):
                break
            m[at.ACC] = m[at.XRAM + p]
            external(m, h, log, now)
        elif op == 0xF0:  # MOVX @DPTR,A
            h[at.TOUCHED] = 1
            m[at.XRAM + dptr(m)] = m[at.ACC]
            external(m, h, log, now)
        elif op == 0xE2:  # MOVX A,@Ri
            p = (byte(m, at.P2) << 8) | byte(m, bank(m) | n)
            if bus_waits(h, p):
                break
            m[at.ACC] = m[at.XRAM + p]
            external(m, h, log, now)
        elif op == 0xF2:  # MOVX @Ri,A
            h[at.TOUCHED] = 1
            m[at.XRAM + ((byte(m, at.P2) << 8) | byte(m, bank(m) | n))] = m[at.ACC]
            external(m, h, log, now)
        elif op == 0xC3:  # CLR C
            set_carry(m, 0)
        elif op == 0xD3:  # SETB C
            set_carry(m, 1)
        elif op == 0xB3:  # CPL C
            set_carry(m, carry(m) ^ 1)
        elif op == 0xC2:  # CLR bit
            put(m, h, log, w, y, hold(m, h, log, w, y, now) & ~(1 << ((w >> at.BIT_AT) & 7)), now)
        elif op == 0xD2:  # SETB bit
            put(m, h, log, w, y, hold(m, h, log, w, y, now) | (1 << ((w >> at.BIT_AT) & 7)), now)
        elif op == 0xB2:  # CPL bit
            put(m, h, log, w, y, hold(m, h, log, w, y, now) ^ (1 << ((w >> at.BIT_AT) & 7)), now)
        elif op == 0x92:  # MOV bit,C
            value = hold(m, h, log, w, y, now) & ~(1 << ((w >> at.BIT_AT) & 7))
            put(m, h, log, w, y, value | (carry(m) << ((w >> at.BIT_AT) & 7)), now)
        elif op == 0xA2:  # MOV C,bit
            set_carry(m, (get(m, h, log, w, y, cycles) >> ((w >> at.BIT_AT) & 7)) & 1)
        elif op == 0x82:  # ANL C,bit
            set_carry(m, carry(m) & (get(m, h, log, w, y, cycles) >> ((w >> at.BIT_AT) & 7)))
        elif op == 0xB0:  # ANL C,/bit
            set_carry(m, carry(m) & ~(get(m, h, log, w, y, cycles) >> ((w >> at.BIT_AT) & 7)))
        elif op == 0x72:  # ORL C,bit
            set_carry(m, carry(m) | ((get(m, h, log, w, y, cycles) >> ((w >> at.BIT_AT) & 7)) & 1))
        elif op == 0xA0:  # ORL C,/bit
            set_carry(m, carry(m) | (~(get(m, h, log, w, y, cycles) >> ((w >> at.BIT_AT) & 7)) & 1))
        elif op == 0x24:  # ADD A,#data
            add(m, y, 0)
        elif op == 0x25:  # ADD A,direct
            add(m, get(m, h, log, w, y, cycles), 0)
        elif op == 0x26:  # ADD A,@Ri
            p = byte(m, bank(m) | n)
            if p > top:
                kind = at.FAULT_INDIRECT
                break
            add(m, byte(m, p), 0)
        elif op == 0x28:  # ADD A,Rn
            add(m, byte(m, bank(m) | n), 0)
        elif op == 0x34:  # ADDC A,#data
            add(m, y, carry(m))
        elif op == 0x35:  # ADDC A,direct
            add(m, get(m, h, log, w, y, cycles), carry(m))
        elif op == 0x36:  # ADDC A,@Ri
            p = byte(m, bank(m) | n)
            if p > top:
                kind = at.FAULT_INDIRECT
                break
            add(m, byte(m, p), carry(m))
        elif op == 0x38:  # ADDC A,Rn
            add(m, byte(m, bank(m) | n), carry(m))
        elif op == 0x44:  # ORL A,#data
            m[at.ACC] = byte(m, at.ACC) | y
        elif op == 0x45:  # ORL A,direct
            m[at.ACC] = byte(m, at.ACC) | get(m, h, log, w, y, cycles)
        elif op == 0x46:  # ORL A,@Ri
            p = byte(m, bank(m) | n)
            if p > top:
                kind = at.FAULT_INDIRECT
                break
            m[at.ACC] = byte(m, at.ACC) | byte(m, p)
        elif op == 0x48:  # ORL A,Rn
            m[at.ACC] = byte(m, at.ACC) | byte(m, bank(m) | n)
        elif op == 0x54:  # ANL A,#data
            m[at.ACC] = byte(m, at.ACC) & y
        elif op == 0x55:  # ANL A,direct
            m[at.ACC] = byte(m, at.ACC) & get(m, h, log, w, y, cycles)
        elif op == 0x56:  # ANL A,@Ri
            p = byte(m, bank(m) | n)
            if p > top:
                kind = at.FAULT_INDIRECT
                break
            m[at.ACC] = byte(m, at.ACC) & byte(m, p)
        elif op == 0x58:  # ANL A,Rn
            m[at.ACC] = byte(m, at.ACC) & byte(m, bank(m) | n)
        elif op == 0x64:  # XRL A,#data
            m[at.ACC] = byte(m, at.ACC) ^ y
        elif op == 0x65:  # XRL A,direct
            m[at.ACC] = byte(m, at.ACC) ^ get(m, h, log, w, y, cycles)
        elif op == 0x66:  # XRL A,@Ri
            p = byte(m, bank(m) | n)
            if p > top:
                kind = at.FAULT_INDIRECT
                break
            m[at.ACC] = byte(m, at.ACC) ^ byte(m, p)
        elif op == 0x68:  # XRL A,Rn
            m[at.ACC] = byte(m, at.ACC) ^ byte(m, bank(m) | n)
        elif op == 0x94:  # SUBB A,#data
            subtract(m, y)
        elif op == 0x95:  # SUBB A,direct
            subtract(m, get(m, h, log, w, y, cycles))
        elif op == 0x96:  # SUBB A,@Ri
            p = byte(m, bank(m) | n)
            if p > top:
                kind = at.FAULT_INDIRECT
                break
            subtract(m, byte(m, p))
        elif op == 0x98:  # SUBB A,Rn
            subtract(m, byte(m, bank(m) | n))
        elif op == 0x42:  # ORL direct,A
            put(m, h, log, w, y, hold(m, h, log, w, y, now) | byte(m, at.ACC), now)
        elif op == 0x43:  # ORL direct,#data
            put(m, h, log, w, y, hold(m, h, log, w, y, now) | x, now)
        elif op == 0x52:  # ANL direct,A
            put(m, h, log, w, y, hold(m, h, log, w, y, now) & byte(m, at.ACC), now)
        elif op == 0x53:  # ANL direct,#data
            put(m, h, log, w, y, hold(m, h, log, w, y, now) & x, now)
        elif op == 0x62:  # XRL direct,A
            put(m, h, log, w, y, hold(m, h, log, w, y, now) ^ byte(m, at.ACC), now)
        elif op == 0x63:  # XRL direct,#data
            put(m, h, log, w, y, hold(m, h, log, w, y, now) ^ x, now)
        elif op == 0x04:  # INC A
            m[at.ACC] = (byte(m, at.ACC) + 1) & 255
        elif op == 0x05:  # INC direct
            put(m, h, log, w, y, (hold(m, h, log, w, y, now) + 1) & 255, now)
        elif op == 0x06:  # INC @Ri
            p = byte(m, bank(m) | n)
            if p > top:
                kind = at.FAULT_INDIRECT
                break
            m[p] = (byte(m, p) + 1) & 255
        elif op == 0x08:  # INC Rn
            p = bank(m) | n
            m[p] = (byte(m, p) + 1) & 255
        elif op == 0x14:  # DEC A
            m[at.ACC] = (byte(m, at.ACC) - 1) & 255
        elif op == 0x15:  # DEC direct
            put(m, h, log, w, y, (hold(m, h, log, w, y, now) - 1) & 255, now)
        elif op == 0x16:  # DEC @Ri
            p = byte(m, bank(m) | n)
            if p > top:
                kind = at.FAULT_INDIRECT
                break
            m[p] = (byte(m, p) - 1) & 255
        elif op == 0x18:  # DEC Rn
            p = bank(m) | n
            m[p] = (byte(m, p) - 1) & 255
        elif op == at.RESERVED:
            kind = at.FAULT_RESERVED
            break
        elif op == at.UNMAPPED_SFR:
            kind = at.FAULT_UNMAPPED
            break
        elif op == at.OUTSIDE_IMAGE:
            kind = at.FAULT_OUTSIDE
            break
        cycles = now
        executed += 1
        if w & at.BACK != 0 and after <= pc:
            if pc != turn_pc:
                turn_pc, turns = pc, 0
            turns += 1
            if turns == TURNS_BEFORE:
                keep_turn(m, h, cycles, executed)
            elif turns > TURNS_BEFORE:
                skipped = turns_to_skip(m, h, cycles)
                turns = 0 if skipped > 0 else -TURNS_BETWEEN
                executed += skipped * (executed - h[at.TURN_COUNT])
                cycles += skipped * (cycles - h[at.TURN_CYCLES])
        pc = after
    if kind != at.FAULT_NONE:
        h[at.FAULT] = kind
        h[at.STOP] = at.STOP_FAULT
    h[at.PC], h[at.CYCLES], h[at.COUNT] = pc, cycles, executed
    move_pins(m, h, log, changes, cycles - 1)  # what the last instruction has met counts where it came
    refresh(m, h, log, cycles)
    m[at.PSW] = (byte(m, at.PSW) & 0xFE) | parity(m)
