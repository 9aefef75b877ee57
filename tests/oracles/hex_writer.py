"""Images written as Intel HEX: sixteen bytes in a record, upper-case digits."""

from pathlib import Path


def write_hex(image, path):
    """Write the used ranges of an image."""
    pieces = [
        (0, at, image.code[at : min(at + 16, end)]) for begin, end in image.used for at in range(begin, end, 16)
    ]
    lines = []
    for kind, address, data in [*pieces, (1, 0, b"")]:
        body = bytes([len(data), *address.to_bytes(2), kind]) + data
        lines.append(f":{body.hex().upper()}{-sum(body) & 0xFF:02X}\n")
    Path(path).write_text("".join(lines), encoding="ascii", newline="\n")
