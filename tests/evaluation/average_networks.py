#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The average of two networks of one shape, weight by weight.

    tests/evaluation/average_networks.py FIRST SECOND SHARE OUTPUT     # (1 - SHARE) FIRST + SHARE SECOND

Files are safetensors of 16- or 32-bit floats. A network and what was trained further from it are near
enough for their average to be a network of its own; two that were trained apart are not. What both must
agree in (names and shapes of tensors, statistics that inputs are normalized by, metadata of the shape) is compared.
"""
import json
import os
import struct
import sys

import numpy

TYPES = {"F16": numpy.float16, "F32": numpy.float32}


def read(path):
    try:
        with open(path, "rb") as file:
            data = file.read()
        (size,) = struct.unpack("<Q", data[:8])
        header = json.loads(data[8 : 8 + size])
    except (OSError, struct.error, ValueError) as error:
        sys.exit(f"{path}: no safetensors file: {error}")
    for name, tensor in header.items():
        if name != "__metadata__" and tensor["dtype"] not in TYPES:
            sys.exit(f"{path}: {name} is {tensor['dtype']}; give weights of {' or '.join(TYPES)}")
    return header, data[8 + size :]


def values(header, data, name):
    begin, end = header[name]["data_offsets"]
    return numpy.frombuffer(data[begin:end], TYPES[header[name]["dtype"]])


def main():
    if len(sys.argv) != 5:
        sys.exit(__doc__)
    first, second, given, output = sys.argv[1:]
    try:
        share = float(given)
    except ValueError:
        share = -1.0
    if not 0.0 <= share <= 1.0:
        sys.exit(f"share {given}: give a number from 0 to 1")
    (a, a_data), (b, b_data) = read(first), read(second)
    averaged = bytearray(a_data)
    for name in a.keys() | b.keys():
        if name == "__metadata__":
            continue
        if name not in a or name not in b or a[name]["shape"] != b[name]["shape"]:
            sys.exit(f"{second}: {name} is not what {first} has; average networks of one shape")
        x, y = (values(*of, name).astype(numpy.float32) for of in ((a, a_data), (b, b_data)))
        if name.startswith("statistics") and not numpy.allclose(x, y, rtol=1e-3, atol=1e-6):
            sys.exit(f"{second}: {name} differs; average a network with one that was trained from it")
        begin, end = a[name]["data_offsets"]
        averaged[begin:end] = ((1.0 - share) * x + share * y).astype(TYPES[a[name]["dtype"]]).tobytes()
    # What was measured of the first is not true of the average.
    about = {key: text for key, text in a.get("__metadata__", {}).items() if key not in ("iteration", "validation")}
    about["average"] = f"{1.0 - share:g} of one network, {share:g} of what was trained from it"
    header = json.dumps(a | {"__metadata__": about}).encode()
    header += b" " * (-len(header) % 8)
    part = output + ".part"  # never half a network under its name
    with open(part, "wb") as file:
        file.write(struct.pack("<Q", len(header)) + header + averaged)
    os.replace(part, output)


main()
