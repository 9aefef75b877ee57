"""The one table of the MCS-51 instruction set: 111 forms, from which all 256 opcodes are expanded.

Each row gives the first opcode of a form, its mnemonic and operands, its length, the machine cycles of the original
12-clock part, the clocks of a one-clock part (branch not taken / taken), what it does and the flags it changes. The
dispatch of the processor, the disassembler and the table of the documentation are derived from it.

References
----------
Intel, "MCS 51 Microcontroller Family User's Manual" (272383-002, 1994), chapter 2, table 10 (instruction set summary,
oscillator periods) and table 11 (opcodes in hexadecimal order).
Silicon Labs, "C8051F120/1/2/3/4/5/6/7, C8051F130/1/2/3" data sheet, section 11.1 and table 11.1 (CIP-51 instruction
set summary). A branch counts its second figure when taken. Zero-wait code memory is taken: a jump that misses the
branch target cache stalls for up to four clocks more (section 16), which is not in the figures.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

RESERVED_OPCODE = 0xA5
"""The only opcode that the manual's table 11 leaves free."""


class Operand(Enum):
    """An addressing mode; the value is how the manual writes it.

    Examples
    --------
    >>> Operand.DIRECT.value
    'direct'
    """

    A = "A"
    AB = "AB"
    C = "C"
    DPTR = "DPTR"
    RN = "Rn"
    AT_RI = "@Ri"
    AT_DPTR = "@DPTR"
    AT_A_DPTR = "@A+DPTR"
    AT_A_PC = "@A+PC"
    DIRECT = "direct"
    IMMEDIATE = "#data"
    IMMEDIATE16 = "#data16"
    BIT = "bit"
    NOT_BIT = "/bit"
    REL = "rel"
    ADDR11 = "addr11"
    ADDR16 = "addr16"


@dataclass(frozen=True, slots=True, kw_only=True)
class Instruction:
    """One opcode.

    Examples
    --------
    >>> add = INSTRUCTIONS[0x2B]
    >>> add.text, add.form, add.cycles, add.flags
    ('ADD A,Rn', 40, 1, 'CY AC OV')
    """

    opcode: int
    """0..255."""
    form: int
    """First opcode of the form: the same for the eight registers, the two pointers, the eight pages."""
    mnemonic: str
    """As the manual writes it; ``"reserved"`` for 0xA5."""
    operands: tuple[Operand, ...]
    """Addressing modes in the order of the assembler."""
    length: int
    """Bytes."""
    cycles: int
    """Machine cycles of the 12-clock part, of 12 oscillator periods each."""
    clocks: int
    clocks_taken: int
    """Clocks of the one-clock part, where a branch is not taken and where it is."""
    operation: str
    """What it does."""
    flags: str
    """Flags of the PSW that it changes, beyond P, which always follows A."""

    @property
    def text(self) -> str:
        """Mnemonic and addressing modes."""
        return f"{self.mnemonic} {','.join(operand.value for operand in self.operands)}".strip()


# opcode | assembler | bytes | machine cycles | clocks[/taken] | operation | flags
_ROWS = """
00 | NOP               | 1 | 1 | 1   | nothing |
01 | AJMP addr11       | 2 | 2 | 3   | PC <- PC[15:11] : addr11 |
02 | LJMP addr16       | 3 | 2 | 4   | PC <- addr16 |
03 | RR A              | 1 | 1 | 1   | rotate A right |
04 | INC A             | 1 | 1 | 1   | A <- A + 1 |
05 | INC direct        | 2 | 1 | 2   | (direct) <- (direct) + 1 |
06 | INC @Ri           | 1 | 1 | 2   | (Ri) <- (Ri) + 1 |
08 | INC Rn            | 1 | 1 | 1   | Rn <- Rn + 1 |
10 | JBC bit,rel       | 3 | 2 | 3/4 | jump and clear where the bit is set |
11 | ACALL addr11      | 2 | 2 | 3   | push PC; PC <- PC[15:11] : addr11 |
12 | LCALL addr16      | 3 | 2 | 4   | push PC; PC <- addr16 |
13 | RRC A             | 1 | 1 | 1   | rotate A right through CY | CY
14 | DEC A             | 1 | 1 | 1   | A <- A - 1 |
15 | DEC direct        | 2 | 1 | 2   | (direct) <- (direct) - 1 |
16 | DEC @Ri           | 1 | 1 | 2   | (Ri) <- (Ri) - 1 |
18 | DEC Rn            | 1 | 1 | 1   | Rn <- Rn - 1 |
20 | JB bit,rel        | 3 | 2 | 3/4 | jump where the bit is set |
22 | RET               | 1 | 2 | 5   | pop PC |
23 | RL A              | 1 | 1 | 1   | rotate A left |
24 | ADD A,#data       | 2 | 1 | 2   | A <- A + data | CY AC OV
25 | ADD A,direct      | 2 | 1 | 2   | A <- A + (direct) | CY AC OV
26 | ADD A,@Ri         | 1 | 1 | 2   | A <- A + (Ri) | CY AC OV
28 | ADD A,Rn          | 1 | 1 | 1   | A <- A + Rn | CY AC OV
30 | JNB bit,rel       | 3 | 2 | 3/4 | jump where the bit is clear |
32 | RETI              | 1 | 2 | 5   | pop PC; end the interrupt level in service |
33 | RLC A             | 1 | 1 | 1   | rotate A left through CY | CY
34 | ADDC A,#data      | 2 | 1 | 2   | A <- A + data + CY | CY AC OV
35 | ADDC A,direct     | 2 | 1 | 2   | A <- A + (direct) + CY | CY AC OV
36 | ADDC A,@Ri        | 1 | 1 | 2   | A <- A + (Ri) + CY | CY AC OV
38 | ADDC A,Rn         | 1 | 1 | 1   | A <- A + Rn + CY | CY AC OV
40 | JC rel            | 2 | 2 | 2/3 | jump where CY is set |
42 | ORL direct,A      | 2 | 1 | 2   | (direct) <- (direct) or A |
43 | ORL direct,#data  | 3 | 2 | 3   | (direct) <- (direct) or data |
44 | ORL A,#data       | 2 | 1 | 2   | A <- A or data |
45 | ORL A,direct      | 2 | 1 | 2   | A <- A or (direct) |
46 | ORL A,@Ri         | 1 | 1 | 2   | A <- A or (Ri) |
48 | ORL A,Rn          | 1 | 1 | 1   | A <- A or Rn |
50 | JNC rel           | 2 | 2 | 2/3 | jump where CY is clear |
52 | ANL direct,A      | 2 | 1 | 2   | (direct) <- (direct) and A |
53 | ANL direct,#data  | 3 | 2 | 3   | (direct) <- (direct) and data |
54 | ANL A,#data       | 2 | 1 | 2   | A <- A and data |
55 | ANL A,direct      | 2 | 1 | 2   | A <- A and (direct) |
56 | ANL A,@Ri         | 1 | 1 | 2   | A <- A and (Ri) |
58 | ANL A,Rn          | 1 | 1 | 1   | A <- A and Rn |
60 | JZ rel            | 2 | 2 | 2/3 | jump where A = 0 |
62 | XRL direct,A      | 2 | 1 | 2   | (direct) <- (direct) xor A |
63 | XRL direct,#data  | 3 | 2 | 3   | (direct) <- (direct) xor data |
64 | XRL A,#data       | 2 | 1 | 2   | A <- A xor data |
65 | XRL A,direct      | 2 | 1 | 2   | A <- A xor (direct) |
66 | XRL A,@Ri         | 1 | 1 | 2   | A <- A xor (Ri) |
68 | XRL A,Rn          | 1 | 1 | 1   | A <- A xor Rn |
70 | JNZ rel           | 2 | 2 | 2/3 | jump where A is not 0 |
72 | ORL C,bit         | 2 | 2 | 2   | CY <- CY or bit | CY
73 | JMP @A+DPTR       | 1 | 2 | 3   | PC <- A + DPTR |
74 | MOV A,#data       | 2 | 1 | 2   | A <- data |
75 | MOV direct,#data  | 3 | 2 | 3   | (direct) <- data |
76 | MOV @Ri,#data     | 2 | 1 | 2   | (Ri) <- data |
78 | MOV Rn,#data      | 2 | 1 | 2   | Rn <- data |
80 | SJMP rel          | 2 | 2 | 3   | PC <- PC + rel |
82 | ANL C,bit         | 2 | 2 | 2   | CY <- CY and bit | CY
83 | MOVC A,@A+PC      | 1 | 2 | 3   | A <- code (A + PC) |
84 | DIV AB            | 1 | 4 | 8   | A, B <- A / B, A mod B | CY OV
85 | MOV direct,direct | 3 | 2 | 3   | (second) <- (first); the source is coded first |
86 | MOV direct,@Ri    | 2 | 2 | 2   | (direct) <- (Ri) |
88 | MOV direct,Rn     | 2 | 2 | 2   | (direct) <- Rn |
90 | MOV DPTR,#data16  | 3 | 2 | 3   | DPTR <- data16 |
92 | MOV bit,C         | 2 | 2 | 2   | bit <- CY |
93 | MOVC A,@A+DPTR    | 1 | 2 | 3   | A <- code (A + DPTR) |
94 | SUBB A,#data      | 2 | 1 | 2   | A <- A - data - CY | CY AC OV
95 | SUBB A,direct     | 2 | 1 | 2   | A <- A - (direct) - CY | CY AC OV
96 | SUBB A,@Ri        | 1 | 1 | 2   | A <- A - (Ri) - CY | CY AC OV
98 | SUBB A,Rn         | 1 | 1 | 1   | A <- A - Rn - CY | CY AC OV
A0 | ORL C,/bit        | 2 | 2 | 2   | CY <- CY or not bit | CY
A2 | MOV C,bit         | 2 | 1 | 2   | CY <- bit | CY
A3 | INC DPTR          | 1 | 2 | 1   | DPTR <- DPTR + 1 |
A4 | MUL AB            | 1 | 4 | 4   | B : A <- A x B | CY OV
A5 | reserved          | 1 | 1 | 1   | none: a fault |
A6 | MOV @Ri,direct    | 2 | 2 | 2   | (Ri) <- (direct) |
A8 | MOV Rn,direct     | 2 | 2 | 2   | Rn <- (direct) |
B0 | ANL C,/bit        | 2 | 2 | 2   | CY <- CY and not bit | CY
B2 | CPL bit           | 2 | 1 | 2   | bit <- not bit |
B3 | CPL C             | 1 | 1 | 1   | CY <- not CY | CY
B4 | CJNE A,#data,rel  | 3 | 2 | 3/4 | compare, jump where unequal; CY <- A < data | CY
B5 | CJNE A,direct,rel | 3 | 2 | 3/4 | compare, jump where unequal; CY <- A < (direct) | CY
B6 | CJNE @Ri,#data,rel| 3 | 2 | 4/5 | compare, jump where unequal; CY <- (Ri) < data | CY
B8 | CJNE Rn,#data,rel | 3 | 2 | 3/4 | compare, jump where unequal; CY <- Rn < data | CY
C0 | PUSH direct       | 2 | 2 | 2   | SP <- SP + 1; (SP) <- (direct) |
C2 | CLR bit           | 2 | 1 | 2   | bit <- 0 |
C3 | CLR C             | 1 | 1 | 1   | CY <- 0 | CY
C4 | SWAP A            | 1 | 1 | 1   | exchange the halves of A |
C5 | XCH A,direct      | 2 | 1 | 2   | A <-> (direct) |
C6 | XCH A,@Ri         | 1 | 1 | 2   | A <-> (Ri) |
C8 | XCH A,Rn          | 1 | 1 | 1   | A <-> Rn |
D0 | POP direct        | 2 | 2 | 2   | (direct) <- (SP); SP <- SP - 1 |
D2 | SETB bit          | 2 | 1 | 2   | bit <- 1 |
D3 | SETB C            | 1 | 1 | 1   | CY <- 1 | CY
D4 | DA A              | 1 | 1 | 1   | decimal-adjust A after an addition | CY
D5 | DJNZ direct,rel   | 3 | 2 | 3/4 | (direct) <- (direct) - 1; jump where not 0 |
D6 | XCHD A,@Ri        | 1 | 1 | 2   | A[3:0] <-> (Ri)[3:0] |
D8 | DJNZ Rn,rel       | 2 | 2 | 2/3 | Rn <- Rn - 1; jump where not 0 |
E0 | MOVX A,@DPTR      | 1 | 2 | 3   | A <- external (DPTR) |
E2 | MOVX A,@Ri        | 1 | 2 | 3   | A <- external (P2 : Ri) |
E4 | CLR A             | 1 | 1 | 1   | A <- 0 |
E5 | MOV A,direct      | 2 | 1 | 2   | A <- (direct) |
E6 | MOV A,@Ri         | 1 | 1 | 2   | A <- (Ri) |
E8 | MOV A,Rn          | 1 | 1 | 1   | A <- Rn |
F0 | MOVX @DPTR,A      | 1 | 2 | 3   | external (DPTR) <- A |
F2 | MOVX @Ri,A        | 1 | 2 | 3   | external (P2 : Ri) <- A |
F4 | CPL A             | 1 | 1 | 1   | A <- not A |
F5 | MOV direct,A      | 2 | 1 | 2   | (direct) <- A |
F6 | MOV @Ri,A         | 1 | 1 | 2   | (Ri) <- A |
F8 | MOV Rn,A          | 1 | 1 | 1   | Rn <- A |
"""


def _opcodes(form: int, operands: tuple[Operand, ...]) -> range:
    """Return the opcodes of a form: registers count in the lowest bits, pages of AJMP and ACALL in the highest."""
    if Operand.RN in operands:
        return range(form, form + 8)
    if Operand.AT_RI in operands:
        return range(form, form + 2)
    if Operand.ADDR11 in operands:
        return range(form, 256, 0x20)
    return range(form, form + 1)


def _expand() -> tuple[Instruction, ...]:
    table: dict[int, Instruction] = {}
    for row in _ROWS.strip().splitlines():
        first, assembler, length, cycles, clocks, operation, flags = (cell.strip() for cell in row.split("|"))
        mnemonic, _, modes = assembler.partition(" ")
        operands = tuple(Operand(mode.strip()) for mode in modes.split(",") if mode.strip())
        not_taken, _, taken = clocks.partition("/")
        form = int(first, 16)
        for opcode in _opcodes(form, operands):
            table[opcode] = Instruction(
                opcode=opcode,
                form=form,
                mnemonic=mnemonic,
                operands=operands,
                length=int(length),
                cycles=int(cycles),
                clocks=int(not_taken),
                clocks_taken=int(taken or not_taken),
                operation=operation,
                flags=flags,
            )
    return tuple(table[opcode] for opcode in range(256))


INSTRUCTIONS: tuple[Instruction, ...] = _expand()
"""The 256 opcodes, the reserved one included, at their own index."""
