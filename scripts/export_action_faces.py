#!/usr/bin/env python3
"""Writes neutral faces and their FACS shapes for `cargo run --example action_library`.

    scripts/export_action_faces.py --ict DIR --makehuman DIR --landmark-table CSV -o OUT

DIRs hold ICT-FaceKit's and MakeHuman's heads as ict_face9409_i16.npz with ict_names.json, and makehuman_head.npz with
makehuman_head_names.json; the table names the ICT vertex of each landmark (column ict_vertex). OUT receives one
NAME.obj (triangles, millimetres) and NAME.pc2 (one sample a shape) a face, and faces.json. Needs numpy.
"""

import argparse
import csv
import json
import pathlib
import struct

import numpy as np

ICT_IDENTITIES = [1, 2, 3, 4, 5, 6]
MAKEHUMAN = [f"{people}-{sex}-{age}" for people in ("african", "asian", "caucasian")
             for sex, age in (("female", "young"), ("male", "old"))]


def triangles(quads):
    return np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


def write_face(out, name, neutral, quads, shapes):
    with open(out / f"{name}.obj", "w", encoding="utf-8") as file:
        file.writelines(f"v {x:.5f} {y:.5f} {z:.5f}\n" for x, y, z in neutral)
        file.writelines(f"f {a + 1} {b + 1} {c + 1}\n" for a, b, c in triangles(quads))
    with open(out / f"{name}.pc2", "wb") as file:
        file.write(b"POINTCACHE2\0" + struct.pack("<iiffi", 1, len(neutral), 0.0, 1.0, len(shapes)))
        for shape in shapes:
            file.write((neutral + shape).astype("<f4").tobytes())


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--ict", type=pathlib.Path, required=True)
    parser.add_argument("--makehuman", type=pathlib.Path, required=True)
    parser.add_argument("--landmark-table", type=pathlib.Path, required=True)
    parser.add_argument("-o", "--output", type=pathlib.Path, required=True)
    given = parser.parse_args()
    out = given.output
    out.mkdir(parents=True, exist_ok=True)
    faces = []

    ict = np.load(given.ict / "ict_face9409_i16.npz")
    names = json.loads((given.ict / "ict_names.json").read_text())["expr_names"]
    shapes = ict["expr_q"].astype(float) * ict["expr_scale"][:, None, None] * 10.0
    modes = ict["ident_q"].astype(float) * ict["ident_scale"][:, None, None]
    quads = ict["quads"]
    for seed in [None, *ICT_IDENTITIES]:
        weights = np.zeros(100) if seed is None else np.random.default_rng(seed).standard_normal(100).clip(-2.5, 2.5)
        neutral = (ict["neutral"] + np.tensordot(weights, modes, 1)) * 10.0
        name = "ict_mean" if seed is None else f"ict_{seed}"
        write_face(out, name, neutral, quads, shapes)
        faces.append({"name": name, "rig": "ICT-FaceKit", "shapes": names})
    with open(given.landmark_table, encoding="utf-8") as table:
        ict_landmarks = [int(row["ict_vertex"]) for row in csv.DictReader(table)][:468]

    head = np.load(given.makehuman / "makehuman_head.npz")
    meta = json.loads((given.makehuman / "makehuman_head_names.json").read_text())
    units = meta["unit_names"]
    arkit = [n.replace("Left", "_L").replace("Right", "_R") for n in meta["arkit_names"]]
    # mouthLeft and mouthRight are directions, not sides.
    arkit = [n if n not in ("mouth_L", "mouth_R", "jaw_L", "jaw_R") else n.replace("_L", "Left").replace("_R", "Right")
             for n in arkit]
    unit = {n: i for i, n in enumerate(units)}
    extra = ["unit nose-dilatation_L", "unit nose-dilatation_R", "unit nose-compression"]
    for name in MAKEHUMAN:
        neutral = head["base"] + head["identity"][meta["identity_names"].index(name)]
        people = meta["units_ethnicity"].index(name.split("-")[0])
        own = head["units"][people]
        scale = 100.0  # decimetres
        wanted = [own[unit["nose-left-dilatation"]], own[unit["nose-right-dilatation"]], own[unit["nose-compression"]]]
        deltas = [*head["arkit"], *wanted]
        write_face(out, f"makehuman_{name}", neutral * scale, head["quads"], [d * scale for d in deltas])
        faces.append({"name": f"makehuman_{name}", "rig": "MakeHuman", "shapes": arkit + extra})
    (out / "faces.json").write_text(json.dumps({"ict_landmarks": ict_landmarks, "faces": faces}))


if __name__ == "__main__":
    main()
