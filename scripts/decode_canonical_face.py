#!/usr/bin/env python3
"""Decode the canonical face mesh of Google's Face Landmarker into plain JSON.

The task bundle holds `geometry_pipeline_metadata_landmarks.binarypb`, a protocol buffer of two things:

    message GeometryPipelineMetadata { Mesh3d canonical_mesh = 1; repeated Basis basis = 2; ... }
    message Mesh3d { ...; repeated float vertex_buffer = 3; repeated uint32 index_buffer = 4; }
    message Basis  { uint32 landmark_id = 1; float weight = 2; }

The vertex buffer interleaves x, y, z (centimetres, +Y up, +Z out of the face, +X to the subject's left) and
u, v. Vertex i is landmark i of the network. Only the wire format is read, so nothing needs to be installed.

usage: decode_canonical_face.py IN.binarypb OUT.json
"""

import json
import struct
import sys

VARINT, FIXED64, BYTES, FIXED32 = 0, 1, 2, 5
VERTICES, TRIANGLES = 468, 898


def varint(data, at):
    """The base-128 number at `at`, and the position behind it."""
    value = shift = 0
    while True:
        byte = data[at]
        at += 1
        value |= (byte & 0x7F) << shift
        if byte < 0x80:
            return value, at
        shift += 7


def fields(data):
    """Yield (field number, wire type, value) of one message; fixed and length-delimited values stay bytes."""
    at = 0
    while at < len(data):
        key, at = varint(data, at)
        number, wire = key >> 3, key & 7
        if wire == VARINT:
            value, at = varint(data, at)
        else:
            if wire == BYTES:
                size, at = varint(data, at)
            elif wire in (FIXED32, FIXED64):
                size = 4 if wire == FIXED32 else 8
            else:
                raise ValueError(f"wire type {wire} of field {number} at byte {at} is not known")
            if at + size > len(data):
                raise ValueError(f"field {number} at byte {at} runs past the end")
            value, at = data[at : at + size], at + size
        yield number, wire, value


def floats(value):
    """The little-endian floats in `value`: one of them, or a packed run."""
    return struct.unpack(f"<{len(value) // 4}f", value)


def varints(wire, value):
    """One number, or a packed run."""
    if wire == VARINT:
        return [value]
    numbers, at = [], 0
    while at < len(value):
        number, at = varint(value, at)
        numbers.append(number)
    return numbers


def shortest(number):
    """The shortest decimal that reads back as the same 32-bit float, as a Python float."""
    for digits in range(1, 10):
        text = f"{number:.{digits}g}"
        if struct.pack("<f", float(text)) == struct.pack("<f", number):
            return float(text)
    return number


def decode(data):
    """The mesh and the Procrustes weights as a dictionary ready for JSON."""
    vertex_buffer, index_buffer, weights = [], [], []
    for number, _, value in fields(data):
        if number == 1:
            for inner, wire, item in fields(value):
                if inner == 3:
                    vertex_buffer.extend(floats(item))
                elif inner == 4:
                    index_buffer.extend(varints(wire, item))
        elif number == 2:
            basis = {inner: item for inner, _, item in fields(value)}
            weights.append([basis.get(1, 0), shortest(floats(basis[2])[0])])
    if len(vertex_buffer) != 5 * VERTICES or len(index_buffer) != 3 * TRIANGLES:
        raise ValueError(
            f"wanted {VERTICES} vertices of 5 numbers and {TRIANGLES} triangles, "
            f"found {len(vertex_buffer)} numbers and {len(index_buffer)} indices"
        )
    if max(index_buffer) >= VERTICES or any(index >= VERTICES for index, _ in weights):
        raise ValueError("an index points past the last vertex")
    rows = [[shortest(x) for x in vertex_buffer[i : i + 5]] for i in range(0, len(vertex_buffer), 5)]
    return {
        "positions_cm": [row[:3] for row in rows],
        "uvs": [row[3:] for row in rows],
        "triangles": [index_buffer[i : i + 3] for i in range(0, len(index_buffer), 3)],
        "procrustes_weights": sorted(weights),
    }


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    with open(sys.argv[1], "rb") as source:
        face = decode(source.read())
    with open(sys.argv[2], "w", encoding="ascii", newline="\n") as target:
        json.dump(face, target, separators=(",", ":"))
        target.write("\n")


if __name__ == "__main__":
    main()
