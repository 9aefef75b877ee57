"""All that a design remembers, in the code that Icarus Verilog compiles: a design at rest needs no more ticks.

Two ticks in a row without a change of this, of an input or of an output mean that no later tick changes anything
until something comes in. This holds where the next state follows from these values alone: not where a process waits
in more places than one, or something is delayed, or the time, a file or random numbers are read. The compiled code
shows it.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

_MOST_BITS = 100_000
_MOST_WORDS = 256
_SCOPE = re.compile(r'^(S_\w+) \.scope (\w+), "([^"]+)" "[^"]*"[^;]*?(?:, (S_\w+))?;$')
_VALUE = re.compile(r'^v\w+ \.(?:var|net)(?:/\w+)? "([^"]+)", ([-\d]+) ([-\d]+)[;,]')
_ARRAY = re.compile(r'^v\w+ \.array(?:/\w+)? "([^"]+)", ([-\d]+) ([-\d]+), ([-\d]+) ([-\d]+);')
_INTERNAL = re.compile(r'v\w+ \.(?:(?:net|var)(?:/\w+)? \*"|array/port )')
_LOOP = re.compile(r"\$ivl_for_loop\d+")
_PLAIN = re.compile(r"[A-Za-z_]\w*(?:\[\d+\])?")
_ELSEWHERE = re.compile(
    r"\.(?:var|net)/(?:real|str|queue|darray|cobj)|\.(?:delay|udp|tran|island|modpath|sfunc|dff|latch|force|array/port_pv)\b"
    r"|%(?:delay|delayx|evctl|wait/fork|disable|force|cassign|deassign|release|new|store/obj|assign/\w+(?:/\w+)*/e)\b"
    r'|%vpi_func(?!\S* \d+ \d+ "\$(?:clog2|signed|unsigned|bits)")'
    r'|%vpi_call(?!\S* \d+ \d+ "\$(?:display|write|finish|stop|error|warning|info|fatal|readmem[hb])")'
)
"""What keeps values in other places, or does not follow from values alone."""
_THREAD = re.compile(r"^    \.thread (\w+)", re.MULTILINE)
_WAITS = re.compile(r"^    %wait\b", re.MULTILINE)
_DELAYED = re.compile(r"%assign/\w+(?:/\w+)* .*?, (\d+);")


def memory_of(compiled: str, top: str) -> tuple[str, int] | None:
    """Return a concatenation of all values of a design called ``dut``, and its bits; None where they do not say all.

    Parameters
    ----------
    compiled
        What the compiler wrote for the design alone.
    top
        Its name.
    """
    if _ELSEWHERE.search(compiled) or not all(
        _waits_at_its_beginning(code, name) for code, name in _threads(compiled)
    ):
        return None
    names, bits = [], 0
    for path, high, low in _values(compiled, top):
        if path is None:
            return None
        names.append(path)
        bits += abs(high - low) + 1
    return (f"{{{', '.join(names)}}}", bits) if 0 < bits <= _MOST_BITS else None


def _values(compiled: str, top: str) -> Iterator[tuple[str | None, int, int]]:
    """Yield the path, left and right bound of every value; no path where it has none that can be written."""
    paths: dict[str, str | None] = {}
    path, kept = None, True
    for line in compiled.splitlines():
        if scope := _SCOPE.match(line):
            label, kind, name, parent = scope.groups()
            above = paths.get(parent or "")
            path = f"{above}.{name}" if above and _PLAIN.fullmatch(name) else None
            if parent is None and kind == "module" and name == top:
                path = "dut"
            paths[label] = path
            kept = not (kind.startswith("auto") or _LOOP.fullmatch(name))  # what is set anew before it is used
        elif kept and (value := _VALUE.match(line)):
            yield _within(path, value[1]), int(value[2]), int(value[3])
        elif kept and (array := _ARRAY.match(line)):
            first, last = sorted((int(array[2]), int(array[3])))
            name = _within(path, array[1]) if last - first < _MOST_WORDS else None
            for word in range(first, last + 1) if name else (0,):
                yield name and f"{name}[{word}]", int(array[4]), int(array[5])
        elif kept and line.startswith("v") and not _INTERNAL.match(line):
            yield None, 0, 0


def _within(path: str | None, name: str) -> str | None:
    return f"{path}.{name}" if path is not None and _PLAIN.fullmatch(name) else None


def _threads(compiled: str) -> Iterator[tuple[str, str]]:
    begin = 0
    for thread in _THREAD.finditer(compiled):
        yield compiled[begin : thread.start()], thread[1]
        begin = thread.end()


def _waits_at_its_beginning(code: str, name: str) -> bool:
    """Return whether a process waits nowhere, or only where it begins anew, and delays nothing."""
    instructions = [line.strip() for line in code.splitlines() if line.startswith("    %")]
    for number, instruction in enumerate(instructions):
        delayed = _DELAYED.match(instruction)
        if delayed and "/d " in instruction:
            sets = [line for line in instructions[:number] if re.match(rf"%ix/\S+ {delayed[1]},", line)]
            if not sets or not sets[-1].startswith(f"%ix/load {delayed[1]}, 0, 0;"):
                return False
        elif delayed and delayed[1] != "0":
            return False
    waits = len(_WAITS.findall(code))
    begins = re.search(rf"^{name} ;\n(?:Ewait_.*\n)?    %wait\b", code, re.MULTILINE) is not None
    return waits == 0 or (waits == 1 and begins and instructions[-1] == f"%jmp {name};")
