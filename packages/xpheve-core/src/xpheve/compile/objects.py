"""What an object file asks of the process that loads it: the undefined names of its symbol table (ELF, Mach-O, COFF; little-endian).

Sources: System V ABI, chapter 4 (ELF); Apple, OS X ABI Mach-O File Format Reference; Microsoft, PE Format (COFF).
"""

from __future__ import annotations

import struct

ELF64, MACH64 = b"\x7fELF\x02\x01", 0xFEEDFACF
COFF_MACHINES = (0x8664, 0xAA64)
SYMBOL_TABLE, LC_SYMTAB = 2, 2
MACH_STAB, MACH_TYPE, COFF_EXTERNAL = 0xE0, 0x0E, (2, 105)


def undefined_symbols(code: bytes) -> set[str]:
    """Return the names that ``code`` needs from elsewhere, as they are in C; ValueError if it is no object file of these kinds."""
    try:
        if code.startswith(ELF64):
            return _elf(code)
        if len(code) >= 20 and struct.unpack_from("<I", code)[0] == MACH64:
            return _mach(code)
        if len(code) >= 20 and struct.unpack_from("<H", code)[0] in COFF_MACHINES:
            return _coff(code)
    except struct.error as wrong:
        raise ValueError("an object file that ends too soon") from wrong
    raise ValueError("not an object file of a known kind")


def _name(strings: bytes, start: int) -> str:
    end = strings.find(b"\0", start)
    if not 0 <= start < len(strings) or end < 0:
        raise ValueError("a symbol without a name")
    return strings[start:end].decode("ascii", "replace")


def _elf(code: bytes) -> set[str]:
    (sections,) = struct.unpack_from("<Q", code, 40)
    size, count = struct.unpack_from("<HH", code, 58)
    found: set[str] = set()
    for i in range(count):
        _, kind, _, _, offset, length, link = struct.unpack_from("<IIQQQQI", code, sections + i * size)
        if kind != SYMBOL_TABLE:
            continue
        _, _, _, _, names, names_length = struct.unpack_from("<IIQQQQ", code, sections + link * size)
        strings = code[names : names + names_length]
        for place in range(offset + 24, offset + length, 24):  # the first is empty
            name, _, _, section = struct.unpack_from("<IBBH", code, place)
            if section == 0 and name:
                found.add(_name(strings, name))
    return found


def _mach(code: bytes) -> set[str]:
    (commands,) = struct.unpack_from("<I", code, 16)
    place, found = 32, set()
    for _ in range(commands):
        command, length = struct.unpack_from("<II", code, place)
        if command == LC_SYMTAB:
            symbols, count, names, names_length = struct.unpack_from("<IIII", code, place + 8)
            strings = code[names : names + names_length]
            for i in range(count):
                name, kind, _, _, value = struct.unpack_from("<IBBHQ", code, symbols + 16 * i)
                if not kind & MACH_STAB and not kind & MACH_TYPE and value == 0:
                    found.add(_name(strings, name).removeprefix("_"))
        if length < 8:
            raise ValueError("a load command without a size")
        place += length
    return found


def _coff(code: bytes) -> set[str]:
    symbols, count = struct.unpack_from("<II", code, 8)
    strings = code[symbols + 18 * count :]
    i, found = 0, set()
    while i < count:
        place = symbols + 18 * i
        zero, start = struct.unpack_from("<II", code, place)
        value, section, _, kind, more = struct.unpack_from("<IhHBB", code, place + 8)
        if section == 0 and value == 0 and kind in COFF_EXTERNAL:
            short = code[place : place + 8].rstrip(b"\0").decode("ascii", "replace")
            found.add(_name(strings, start) if zero == 0 else short)
        i += 1 + more
    return found
