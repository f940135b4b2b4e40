"""Writes faces with known motion, by which ways of carrying an expression from face to face are measured.

Targets are identities of the ICT face model put through smooth warps that are known, so that the true motion of every
vertex is known too: W(I + d) - W(I). For A1 the source is the same identity before its warp; for A2 it is the mean face,
whose motion must follow the warp but not the identity's detail. docs/benchmarks/transfer-faces.md has the layout.

    python benches/peers/transfer_faces.py --ict ict_face9409_i16.npz --landmark-table landmark_table.csv \
        --makehuman makehuman_head.npz -o transfer_faces

The names of shapes are read from ict_names.json and makehuman_head_names.json beside the arrays. NumPy 2.2, SciPy 1.15.
"""

import argparse
import csv
import json
from pathlib import Path

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from faces import triangulated, write_obj, write_pc2

IDENTITIES = [101, 102, 103, 104, 105, 106]
# The first three identities and warps were there when the method was chosen; the others were not.
DEVELOPMENT_IDENTITIES = {101, 102, 103}
CENTIMETRE = 10.0
# Motion below which a vertex does not count, centimetres.
STILL = 0.05
# A vertex that none of the ten expressions moves this far, behind this depth, may be an anchor; centimetres.
ANCHOR_MOTION, ANCHOR_DEPTH = 0.13, 6.5
ANCHORS, EXTRAS = 40, 100
MAKEHUMAN_IDENTITY = "caucasian-male-young"
# Vertices of the MakeHuman head at the outer corners of the right and the left eye, and their distance in millimetres
# that an average adult has.
MAKEHUMAN_EYES, MAKEHUMAN_EYE_DISTANCE = (30, 3430), 89.0


def both(name):
    return [name + "_L", name + "_R"]


EXPRESSIONS = {
    "jaw": ["jawOpen"],
    "smile": both("mouthSmile") + both("cheekSquint"),
    "AU1+2": both("browInnerUp") + both("browOuterUp"),
    "AU4+9": both("browDown") + both("noseSneer"),
    "blink": both("eyeBlink"),
    "pucker": ["mouthPucker"],
    "AU15": both("mouthFrown"),
    "AU14": both("mouthDimple"),
    "AU17": ["mouthShrugLower"],
    "AU20": both("mouthStretch"),
}

# Warps: smooth maps of ICT's frame (centimetres, +Y up, +Z out of the face, origin between the ears).
MOUTH, RIGHT_EYE, LEFT_EYE = np.array([0, -3.3, 11.2]), np.array([-3.15, 3.5, 9.3]), np.array([3.15, 3.5, 9.3])
MIDDLE = np.array([0, 0, 5.0])


def near(points, centre, width):
    return np.exp(-np.square(points - centre).sum(1) / (2 * width**2))[:, None]


def rising(t):
    return 1 / (1 + np.exp(-t))


def swell(points, centre, width, by):
    """Enlarges what lies about a centre by a share for each axis."""
    return near(points, centre, width) * (points - centre) * np.array(by)


def bends(points, seed, height, waves=6, length=14.0):
    """A few sine waves in random directions."""
    random, bent = np.random.default_rng(seed), np.zeros_like(points)
    for _ in range(waves):
        along = random.normal(size=3)
        phase = points @ (along / np.linalg.norm(along)) * 2 * np.pi / length + random.uniform(0, 2 * np.pi)
        bent += height * np.sin(phase)[:, None] * random.normal(size=3)
    return bent


def jaw(points, wider, forward=0.0):
    """Widens what lies below the nose, and brings its middle forward."""
    low = rising((-1 - points[:, 1]) / 2)
    middle = np.exp(-np.square(points[:, 0] / 4))
    return np.stack([points[:, 0] * wider * low, 0 * low, forward * low * middle], 1)


def scaled(points, by):
    return MIDDLE + (points - MIDDLE) * np.array(by)


def twisted(points, degrees):
    """Turns the chin aside about the vertical axis, growing downwards."""
    angle = np.deg2rad(degrees) * rising((-3 - points[:, 1]) / 2)
    out, x, z = points.copy(), points[:, 0], points[:, 2] - MIDDLE[2]
    out[:, 0] = x * np.cos(angle) + 0.6 * z * np.sin(angle)
    out[:, 2] = MIDDLE[2] + z * np.cos(angle) - 0.6 * x * np.sin(angle)
    return out


def wide_short(p):
    out = p + jaw(p, 0.22, 0.6)
    out[:, 1] = 3 + (p[:, 1] - 3) * 0.85
    return out


def narrow_long_big_mouth(p):
    return scaled(p + swell(p, MOUTH, 2.6, [0.30, 0.15, 0.05]), [0.88, 1.18, 1.05])


def small_mouth_big_eyes_bent(p):
    out = p - swell(p, MOUTH, 2.6, [0.25, 0.10, 0])
    for eye in (RIGHT_EYE, LEFT_EYE):
        out = out + swell(p, eye, 1.9, [0.22] * 3)
    out = out + near(p, [0, 6, 10], 2.5) * np.array([0, -0.3, 0.6]) + bends(p, 7, 0.18)
    return twisted(out, 10)


def broad_flat_narrow_jaw(p):
    out = p + jaw(p, -0.14) - swell(p, MOUTH, 2.4, [0.20, 0.05, 0.0]) + bends(p, 11, 0.08)
    return scaled(out, [1.14, 0.95, 0.90])


def deep_wide_jaw_big_mouth(p):
    out = p + jaw(p, 0.18, 0.4) + swell(p, MOUTH, 2.5, [0.22, 0.20, 0.05])
    out = out + swell(p, [0, 0.5, 11.5], 1.8, [0.18, 0.10, 0.15]) + bends(p, 23, 0.08)
    return scaled(out, [0.95, 1.05, 1.14])


def wide_small_eyes_twisted(p):
    out = p + jaw(p, 0.08, -0.4) + swell(p, MOUTH, 2.8, [0.12, -0.08, 0.0])
    for eye in (RIGHT_EYE, LEFT_EYE):
        out = out - swell(p, eye, 1.8, [0.14] * 3)
    return twisted(scaled(out + bends(p, 31, 0.08), [1.16, 0.92, 1.0]), -6)


WARPS = [
    ("wide_short", wide_short, None, False),
    ("narrow_long_big_mouth", narrow_long_big_mouth, None, False),
    ("small_mouth_big_eyes_bent", small_mouth_big_eyes_bent, 7, False),
    ("broad_flat_narrow_jaw", broad_flat_narrow_jaw, 11, True),
    ("deep_wide_jaw_big_mouth", deep_wide_jaw_big_mouth, 23, True),
    ("wide_small_eyes_twisted", wide_small_eyes_twisted, 31, True),
]


def smallest_volume(warp, points, step=1e-3):
    """The least determinant of the warp's Jacobian at the points: above 0 it does not fold."""
    steps = [(warp(points + step * axis) - warp(points - step * axis)) / (2 * step) for axis in np.eye(3)]
    return np.linalg.det(np.stack(steps, 2)).min()


class Ict:
    """The ICT face: neutral V x 3, identities and expressions; centimetres."""

    def __init__(self, path):
        arrays = np.load(path)
        with open(path.with_name("ict_names.json"), encoding="utf-8") as file:
            self.names = json.load(file)
        self.neutral = arrays["neutral"].astype(float)
        self.triangles = triangulated(arrays["quads"])
        self.identities, self.identity_scale = arrays["ident_q"], arrays["ident_scale"].astype(float)
        self.shapes = arrays["expr_q"] * arrays["expr_scale"].astype(float)[:, None, None]
        self.landmarks_68 = arrays["lm68"]

    def identity(self, seed):
        """The same coefficients for the same seed: normal, cut off at 2.5."""
        normal = np.random.default_rng(seed).standard_normal(len(self.identities))
        weights = np.clip(normal, -2.5, 2.5) * self.identity_scale
        return self.neutral + np.tensordot(weights, self.identities, 1)

    def motion(self, names):
        return sum(self.shapes[self.names["expr_names"].index(name)] for name in names)


def boundary_loops(triangles):
    """The loops of edges that belong to one triangle alone, each as an ordered list of vertices; shortest first."""
    edges = np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), 1)
    unique, uses = np.unique(edges, axis=0, return_counts=True)
    border = unique[uses == 1]
    size = int(triangles.max()) + 1
    graph = coo_matrix((np.ones(len(border)), (border[:, 0], border[:, 1])), (size, size))
    _, piece = connected_components(graph, directed=False)
    beside = {}
    for a, b in border.tolist():
        beside.setdefault(a, []).append(b)
        beside.setdefault(b, []).append(a)
    loops = []
    for number in sorted(set(piece[border[:, 0]])):
        loop = [min(v for v in beside if piece[v] == number)]
        while ahead := [v for v in beside[loop[-1]] if v not in loop]:
            loop.append(min(ahead))
        loops.append(loop)
    return sorted(loops, key=lambda loop: (len(loop), loop[0]))


def rims(loop, points):
    """A loop split at its outermost vertices in x: upper and lower rim from right to left, and the two corners."""
    loop = np.roll(loop, -int(points[loop, 0].argmin()))
    turn = int(points[loop, 0].argmax())
    sides = sorted([loop[1:turn], loop[:turn:-1]], key=lambda side: -points[side, 1].mean())
    return {"upper": sides[0].tolist(), "lower": sides[1].tolist(), "corners": loop[[0, turn]].tolist()}


def farthest(points, count, start, pool):
    """Vertices of `pool`, each as far as can be from those of `start` and those before it."""
    pool, chosen = np.asarray(pool), []
    distance = np.full(len(pool), np.inf)
    if not len(start):
        chosen = [int(pool[0])]
    for vertex in [*start, *chosen]:
        distance = np.minimum(distance, np.linalg.norm(points[pool] - points[vertex], axis=1))
    while len(chosen) < count:
        chosen.append(int(pool[distance.argmax()]))
        distance = np.minimum(distance, np.linalg.norm(points[pool] - points[chosen[-1]], axis=1))
    return chosen


def protocol(ict, table):
    """Everything that is the same in every case; vertices by number."""
    with open(table, encoding="utf-8") as file:
        rows = sorted(csv.DictReader(file), key=lambda row: int(row["mp_index"]))
    landmarks = [int(row["ict_vertex"]) for row in rows]
    if [int(row["mp_index"]) for row in rows] != list(range(468)):
        raise SystemExit(f"{table} must have a row for each of 468 landmarks")
    points, narrow = ict.neutral, ict.names["n_face_narrow"]
    largest = np.linalg.norm(ict.shapes, axis=2).max(0)
    mask = np.flatnonzero((np.arange(len(points)) < narrow) & (largest > STILL))

    loops = boundary_loops(ict.triangles)
    eyes = sorted(loops[:2], key=lambda loop: points[loop, 0].mean())
    openings = {
        "mouth": rims(loops[2], points),
        "right_eye": rims(eyes[0], points),
        "left_eye": rims(eyes[1], points),
    }
    moved = np.stack([np.linalg.norm(ict.motion(shapes), axis=1) for shapes in EXPRESSIONS.values()]).max(0)
    still = (moved < ANCHOR_MOTION) & (points[:, 2] < ANCHOR_DEPTH)
    still[[vertex for loop in loops for vertex in loop]] = False
    pool = np.flatnonzero(still)
    taken = landmarks + [v for rim in openings.values() for side in rim.values() for v in side]
    return {
        "format": "understudy transfer faces 1",
        "unit": "mm",
        "vertices": len(points),
        "triangles": len(ict.triangles),
        "expressions": [{"name": name, "shapes": shapes} for name, shapes in EXPRESSIONS.items()],
        "evaluation_mask": mask.tolist(),
        "landmarks_468": landmarks,
        "landmark_regions": [row["region"] for row in rows],
        "landmarks_68": ict.landmarks_68.tolist(),
        "rims": openings,
        "zero_anchor_pool": pool.tolist(),
        "zero_anchors": farthest(points, ANCHORS, [], pool),
        "extras": farthest(points, EXTRAS, list(dict.fromkeys(taken)), mask),
    }


def write_cases(ict, seeds, folder):
    """A folder for each identity under each warp, and the mean face once."""
    motions = [ict.motion(shapes) for shapes in EXPRESSIONS.values()]

    def moving(face, warp=lambda points: points):
        return np.stack([warp(face + motion) for motion in motions]) * CENTIMETRE

    mean = ict.neutral * CENTIMETRE
    write_obj(folder / "a2_source.obj", mean, ict.triangles, "ICT mean face, mm")
    write_pc2(folder / "a2_source.pc2", moving(ict.neutral))
    cases = []
    for seed in seeds:
        face = ict.identity(seed)
        for name, warp, warp_seed, is_new in WARPS:
            volume = smallest_volume(warp, face)
            if volume < 0.2:
                raise SystemExit(f"the warp {name} folds the identity {seed} (least determinant {volume:.2f})")
            case = folder / f"case_{len(cases):02d}"
            case.mkdir(exist_ok=True)
            target = warp(face) * CENTIMETRE
            write_obj(case / "target.obj", target, ict.triangles, f"identity {seed} under {name}, mm")
            write_pc2(case / "target_truth.pc2", moving(face, warp))
            write_obj(case / "a1_source.obj", face * CENTIMETRE, ict.triangles, f"identity {seed}, mm")
            write_pc2(case / "a1_source.pc2", moving(face))
            cases.append(
                {
                    "folder": case.name,
                    "identity_seed": seed,
                    "warp": name,
                    "warp_seed": warp_seed,
                    "unseen": is_new and seed not in DEVELOPMENT_IDENTITIES,
                    "least_jacobian_determinant": round(float(volume), 4),
                }
            )
    return cases


def arkit_names(ict_names):
    """ARKit's names of ICT's shapes: the two halves of a shape that ARKit does not split belong together."""
    named = {}
    for name in ict_names:
        whole, _, side = name.partition("_")
        split = {"L": whole + "Left", "R": whole + "Right"}.get(side, whole)
        named.setdefault(whole if whole in ("browInnerUp", "cheekPuff") else split, []).append(name)
    return named


def write_cross(ict, path, folder):
    """The ICT mean and a MakeHuman head with the expressions that both have, for transfer between topologies."""
    arrays = np.load(path)
    with open(path.with_name("makehuman_head_names.json"), encoding="utf-8") as file:
        names = json.load(file)
    base = arrays["base"] + arrays["identity"][names["identity_names"].index(MAKEHUMAN_IDENTITY)].astype(float)
    scale = MAKEHUMAN_EYE_DISTANCE / np.linalg.norm(base[MAKEHUMAN_EYES[0]] - base[MAKEHUMAN_EYES[1]])
    shapes = dict(zip(names["arkit_names"], arrays["arkit"].astype(float)))
    own = arkit_names(ict.names["expr_names"])
    shared = [name for name in own if name in shapes and np.abs(shapes[name]).max() > 0]
    folder.mkdir(exist_ok=True)
    write_obj(folder / "ict.obj", ict.neutral * CENTIMETRE, ict.triangles, "ICT mean face, mm")
    moved = np.stack([ict.neutral + ict.motion(own[name]) for name in shared])
    write_pc2(folder / "ict.pc2", moved * CENTIMETRE)
    triangles = triangulated(arrays["quads"])
    write_obj(folder / "makehuman.obj", base * scale, triangles, f"MakeHuman {MAKEHUMAN_IDENTITY}, mm")
    write_pc2(folder / "makehuman.pc2", np.stack([base + shapes[name] for name in shared]) * scale)
    return {
        "expressions": shared,
        "ict_shapes": [own[name] for name in shared],
        "makehuman_identity": MAKEHUMAN_IDENTITY,
        "makehuman_millimetres_per_unit": round(float(scale), 4),
        "makehuman_vertices": len(base),
        "makehuman_outer_eye_corners": list(MAKEHUMAN_EYES),
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--ict", type=Path, required=True, help="ict_face9409_i16.npz")
    parser.add_argument("--landmark-table", type=Path, required=True, help="CSV with mp_index, ict_vertex and region")
    parser.add_argument("--identities", type=int, nargs="+", default=IDENTITIES, metavar="SEED")
    parser.add_argument("--makehuman", type=Path, help="makehuman_head.npz; without it there is no cross/")
    parser.add_argument("-o", "--output", type=Path, required=True, metavar="DIR")
    options = parser.parse_args()

    ict = Ict(options.ict)
    options.output.mkdir(parents=True, exist_ok=True)
    written = protocol(ict, options.landmark_table)
    written["cases"] = write_cases(ict, options.identities, options.output)
    if options.makehuman:
        written["cross"] = write_cross(ict, options.makehuman, options.output / "cross")
    with open(options.output / "protocol.json", "w", encoding="utf-8") as file:
        json.dump(written, file, indent=1)
        file.write("\n")
    print(f"{len(written['cases'])} cases of {written['vertices']} vertices in {options.output}")


if __name__ == "__main__":
    main()
