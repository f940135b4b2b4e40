"""Writes facial performances whose contractions, motion and poses are known, to measure the analysis of muscles by.

    python benches/peers/muscle_takes.py --ict scans/ict --mocap mocap --landmark-table landmark_table.csv -o OUT

Performers. Neutral faces are identities of the ICT face model (seeds 1 to 4 unless told, within 2.5 standard
deviations) at MediaPipe's 468 landmarks. The 51 shapes are ARKit's without tongueOut; their weights are a Live Link
Face recording's.
  exact         the model's own shapes, the same for all.
  personalised  each shape changed for each performer: its amplitude by 1.25 x U(.7, 1.3); by a smooth random field
                over the face (length 3 cm, relative deviation .4); left against right by up to 15 %; its direction
                turned by a smooth random rotation (.45 rad about each axis); and .12 N(0, 1) of each of the three
                shapes that overlap it most leaks in. For a shape whose largest motion is n > 1 times 15 mm, as the
                stiff jaw's, fields are n times as long, and rotation and lopsidedness 1/n as large. mouthClose is
                changed together with the jawOpen that it corrects, so that lips still meet over an open jaw.
                Calibrated on seeds 1 to 8 to give the motion and the best fit of the model's own shapes in 3D that
                our lifting study had: 7.4 mm and 2 to 2.5 mm, where exact performers move 5.7 mm.
Camera: 640 x 480, focal length 700 px, 55 cm. The head swings by up to 25, 12, 8 degrees (yaw, pitch, roll) and 3 cm.
Pixels: true ones; and with a landmark finder's faults: it reports 1 - .1 (1 + .7 field) of each motion ("under"), and
adds noise that is partly common, partly smooth over the face, partly white, and correlated in time ("noise", a part
of the distance between the eyes' outer corners). It does not slide over a turning face, as a real one does.

takes.json is a list of objects: file, name, kind, performer, seed, noise, under, focal, size, frames, rate, cuts;
null is unknown or none. The kinds:
  basis         the model's mean face and own shapes: neutral 468 x 3, shapes 51 x 468 x 3. Its entry has "shapes",
                names.
  exact, personalised   five stretches of 30 frames at 30 Hz; at `cuts` the weights jump. The head never does.
  turning       the neutral face, 150 frames; only the head turns.
  frontal       the neutral face, 30 frames, the head all but still: to calibrate a performer without a scan.
  markers       41 real optical markers (AnimFace's Jaw and Eyebrows, 30 Hz), as truth and pixels of the landmarks
                nearest to them; NaN at all other landmarks and in `weights`. `neutral` is the model's mean face
                warped onto the markers at rest. The entry has "markers": name and landmark. CC BY-SA 4.0: keep it out
                of the repository.
  training      600 frames in order, at no even rate, from the rest of the recording, more than half a second away
                from every stretch; to refine a basis by. No camera.

A file is one line of JSON, {"name", "kind", "arrays": [[name, [sizes]], ...]}, and after its newline the arrays in
that order, little-endian f32, the last index fastest; millimetres:
  neutral 468 x 3, truth T x 468 x 3 (displacements; both in the scan frame), weights T x 51, and then
    with a camera  pixels T x 468 x 2 (pixel centres at whole numbers, principal point (319.5, 239.5)),
                   rotation T x 3 x 3 and translation T x 3 (camera = rotation x scan + translation);
    training       measured_0.1 and measured_0.3 T x 468 x 3: truth with white noise of .1 and .3 mm.
The scan frame has +X to the subject's left, +Y up, +Z out of the face; the camera's x right, y down, z forward.
"""

import argparse
import json
from pathlib import Path

import numpy as np
from scipy.optimize import lsq_linear

from muscle_markers import marker_take
from muscle_performers import (
    FOCAL,
    LANDMARKS,
    SCORED,
    SIZE,
    UNDER,
    Model,
    head_motion,
    jitter,
    projected,
    range_of_motion,
    reported,
)

# First rows of the stretches: frown, sneer and blink; mouth to the side; broad smile; brows up and eyes wide; talking.
STRETCHES, LENGTH, APART = [870, 2100, 2228, 3600, 3690], 30, 15
TRAINING, MEASURED = 600, [0.1, 0.3]
FAULTS = [(0.0, 0.0), (0.0, UNDER), (0.002, UNDER), (0.004, UNDER)]
STILL = {"turn": (1, 1, 1), "shift": (1, 1, 1)}
FLAT = {"jawLeft", "jawRight", "mouthLeft", "mouthRight"}


def write_take(path, name, kind, arrays):
    header = {"name": name, "kind": kind, "arrays": [[key, list(np.shape(array))] for key, array in arrays.items()]}
    with open(path, "wb") as file:
        file.write(json.dumps(header).encode() + b"\n")
        for array in arrays.values():
            file.write(np.ascontiguousarray(array, "<f4").tobytes())


def read_take(path):
    """The header and the arrays of a take."""
    with open(path, "rb") as file:
        header = json.loads(file.readline())
        content = np.frombuffer(file.read(), "<f4")
    arrays, start = {}, 0
    for key, sizes in header["arrays"]:
        arrays[key] = content[start : start + np.prod(sizes)].reshape(sizes)
        start += np.prod(sizes)
    return header, arrays


class Takes:
    """Writes takes into a folder and keeps their index."""

    def __init__(self, folder):
        self.folder, self.index = folder, []
        folder.mkdir(parents=True, exist_ok=True)

    def add(self, name, kind, arrays, **known):
        write_take(self.folder / f"{name}.bin", name, kind, arrays)
        entry = {"file": f"{name}.bin", "name": name, "kind": kind, "performer": None, "seed": None}
        entry |= {"noise": None, "under": None, "focal": None, "size": None, "rate": 30, "cuts": [0]} | known
        self.index.append(entry | {"frames": len(arrays["truth"]) if "truth" in arrays else 0})

    def film(self, name, kind, neutral, truth, weights, pose, noise, under, rng_seed, **known):
        """Adds a take before the camera; the same seed gives the same faults at every level of noise."""
        part = 1.0
        if under:
            part = reported(neutral, np.random.default_rng([*rng_seed, 53]))[:, None]
        pixels = projected(neutral + truth * part, *pose)
        if noise:
            pixels = pixels + jitter(len(truth), neutral, noise, np.random.default_rng([*rng_seed, 54]))
        arrays = {"neutral": neutral, "truth": truth, "weights": weights, "pixels": pixels}
        arrays |= {"rotation": pose[0], "translation": pose[1]}
        known |= {"noise": noise, "under": under, "focal": FOCAL, "size": SIZE}
        self.add(f"{name}_noise{1000 * noise:.0f}" + ("_under" if under else ""), kind, arrays, **known)

    def close(self):
        (self.folder / "takes.json").write_text(json.dumps(self.index, indent=1) + "\n", encoding="utf-8")


def synthetic(takes, model, weights, seeds):
    stretches = np.concatenate([np.arange(first, first + LENGTH) for first in STRETCHES])
    near = np.abs(np.arange(len(weights))[:, None] - stretches).min(1) <= APART
    others = np.flatnonzero(~near)
    training = others[np.linspace(0, len(others) - 1, TRAINING).astype(int)]
    cuts = list(range(0, len(stretches), LENGTH))
    for seed in seeds:
        for kind in ("exact", "personalised"):
            neutral, shapes = model.performer(seed, kind)
            known = {"performer": kind, "seed": seed}
            played = weights[stretches]
            truth, pose = np.tensordot(played, shapes, 1), head_motion(len(played), seed, neutral)
            for noise, under in FAULTS:
                name = f"{kind}_{seed}"
                takes.film(name, kind, neutral, truth, played, pose, noise, under, [seed], cuts=cuts, **known)
            played = weights[training]
            arrays = {"neutral": neutral, "truth": np.tensordot(played, shapes, 1), "weights": played}
            for level in MEASURED:
                noise = np.random.default_rng([seed, 55]).normal(size=arrays["truth"].shape)
                arrays[f"measured_{level}"] = arrays["truth"] + level * noise
            takes.add(f"training_{kind}_{seed}", "training", arrays, **known | {"rate": None})
        for kind, count, reach in (("turning", len(stretches), {}), ("frontal", LENGTH, STILL)):
            pose, none = head_motion(count, seed + 100, neutral, **reach), np.zeros((count, len(model.names)))
            still = np.zeros((count, LANDMARKS, 3))
            for noise in sorted({noise for noise, _ in FAULTS}):
                takes.film(f"{kind}_{seed}", kind, neutral, still, none, pose, noise, 0.0, [seed, 1], seed=seed)


def optical(takes, model, folder):
    for number, name in enumerate(("Jaw", "Eyebrows")):
        neutral, truth, markers, found = marker_take(folder / f"{name}.csv", model)
        print(f"{name}: {found}; " + " ".join(f"{marker['name']}>{marker['landmark']}" for marker in markers))
        unknown, pose = np.full((len(truth), len(model.names)), np.nan), head_motion(len(truth), 201 + number, neutral)
        for noise in sorted({noise for noise, _ in FAULTS}):
            title = f"markers_{name.lower()}"
            takes.film(title, "markers", neutral, truth, unknown, pose, noise, 0.0, [201 + number], markers=markers)


def root_mean_square(vectors):
    return float(np.sqrt(np.nanmean(np.square(vectors).sum(-1))))


def best_fit(shapes, truth):
    """RMS error, millimetres, of the best weights within [0, 1] of the shapes in 3D."""
    errors = []
    for frame in truth:
        seen = SCORED & np.isfinite(frame[:, 0])
        matrix, goal = shapes[:, seen].reshape(len(shapes), -1).T.astype(float), frame[seen].ravel().astype(float)
        solved = lsq_linear(matrix, goal, (0, 1), method="bvls").x
        errors.append((matrix @ solved - goal).reshape(-1, 3))
    return root_mean_square(np.concatenate(errors))


def summarise(folder, model):
    """Checks what was written and prints a row for each performance, from its take of true pixels."""
    print("| take | frames | no motion, mm | best fit of the model's shapes, mm | reprojection, px | pixels within |")
    print("|---|--:|--:|--:|--:|---|")
    for entry in json.loads((folder / "takes.json").read_text(encoding="utf-8")):
        if entry["noise"] != 0 or entry["under"] != 0:
            continue
        arrays = {key: array.astype(float) for key, array in read_take(folder / entry["file"])[1].items()}
        truth, pixels = arrays["truth"], arrays["pixels"]
        again = projected(arrays["neutral"] + truth, arrays["rotation"], arrays["translation"])
        off = np.nanmax(np.abs(again - pixels))
        bounds = [f"{value:.0f}" for side in (np.nanmin, np.nanmax) for value in side(pixels, axis=(0, 1))]
        motion, fitted = root_mean_square(truth[:, SCORED]), "–"
        if motion:
            fitted = f"{best_fit(model.shapes, truth[:: len(truth) // 15]):.2f}"
        print(f"| {entry['name']} | {len(truth)} | {motion:.2f} | {fitted} | {off:.5f} | {', '.join(bounds)} |")
        if off > 1e-3:
            raise SystemExit(f"{entry['file']}: truth and poses do not give its pixels")


def check_sides(model):
    """Shapes of the left must move landmarks at +X, and a jaw or mouth that goes left must go there."""
    for name, shape in zip(model.names, model.shapes, strict=True):
        sign = name.endswith("Left") - name.endswith("Right")
        size = np.square(shape).sum(1)
        way = shape[:, 0].sum() if name in FLAT else (size * model.neutral[:, 0]).sum() / size.sum()
        if sign * way < 0:
            raise SystemExit(f"{name} moves the wrong side")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--ict", required=True, type=Path, help="folder of ict_face9409_i16.npz and ict_names.json")
    parser.add_argument("--mocap", required=True, type=Path, help="folder of alex_rom_3.csv, Jaw.csv and Eyebrows.csv")
    parser.add_argument("--landmark-table", required=True, type=Path, help="CSV with a column ict_vertex")
    parser.add_argument("--seeds", nargs="+", type=int, default=[1, 2, 3, 4], help="identities (default: 1 2 3 4)")
    parser.add_argument("-o", "--out", required=True, type=Path, help="folder to write")
    given = parser.parse_args()
    model = Model(given.ict, given.landmark_table)
    check_sides(model)
    takes = Takes(given.out)
    takes.add("basis", "basis", {"neutral": model.neutral, "shapes": model.shapes}, shapes=model.names, rate=None)
    synthetic(takes, model, range_of_motion(given.mocap / "alex_rom_3.csv", model.names), given.seeds)
    optical(takes, model, given.mocap)
    takes.close()
    summarise(given.out, model)


if __name__ == "__main__":
    main()
