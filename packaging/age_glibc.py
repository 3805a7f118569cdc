#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Makes libraries of glibc link as an older glibc would: age_glibc.py VERSION FILE...

Of each function that is newer than VERSION, the linker then takes the version before it, or finds no such function. Only the table of
versions in the file changes."""
import re
import struct
import sys

HIDDEN = 0x8000
DYNSYM, VERSYM, VERDEF = 11, 0x6FFFFFFF, 0x6FFFFFFD


def text_at(table: bytes, offset: int) -> str:
    return table[offset:table.index(0, offset)].decode()


def number(version: str) -> tuple:
    found = re.fullmatch(r"GLIBC_(\d+(?:\.\d+)*)", version)
    return tuple(int(part) for part in found[1].split(".")) if found else ()


def age(path: str, newest: tuple) -> int:
    with open(path, "rb") as file:
        data = bytearray(file.read())
    if data[:6] != b"\x7fELF\x02\x01":
        raise SystemExit(f"age_glibc: {path} is no little-endian ELF file of 64 bits")
    table, = struct.unpack_from("<Q", data, 40)
    size, count = struct.unpack_from("<HH", data, 58)
    sections = [struct.unpack_from("<IIQQQQII", data, table + size * i) for i in range(count)]
    by_type = {section[1]: section for section in sections}
    symbols, marks, definitions = by_type[DYNSYM], by_type[VERSYM], by_type[VERDEF]
    _, _, _, _, at, length, link, _ = symbols
    strings = bytes(data[sections[link][4]:sections[link][4] + sections[link][5]])

    versions, position = {}, definitions[4]
    while True:
        _, _, index, _, _, names, step = struct.unpack_from("<HHHHIII", data, position)
        versions[index] = number(text_at(strings, struct.unpack_from("<I", data, position + names)[0]))
        if step == 0:
            break
        position += step

    older, too_new = {}, []
    for i in range(1, length // 24):
        name, _, _, section = struct.unpack_from("<IBBH", data, at + 24 * i)
        mark, = struct.unpack_from("<H", data, marks[4] + 2 * i)
        version = versions.get(mark & ~HIDDEN, ())
        if section == 0 or not version:
            continue
        entry = text_at(strings, name), version, marks[4] + 2 * i, mark
        if version > newest and not mark & HIDDEN:
            too_new.append(entry)
        elif version <= newest and version > older.get(entry[0], ((),))[0]:
            older[entry[0]] = version, entry[2], mark
    for name, _, place, mark in too_new:
        struct.pack_into("<H", data, place, mark | HIDDEN)
        if name in older:
            struct.pack_into("<H", data, older[name][1], older[name][2] & ~HIDDEN)
    with open(path, "wb") as file:
        file.write(data)
    return len(too_new)


if len(sys.argv) < 3:
    raise SystemExit(__doc__)
for file_name in sys.argv[2:]:
    print(f"{file_name}: {age(file_name, number('GLIBC_' + sys.argv[1]))} functions are older now")
