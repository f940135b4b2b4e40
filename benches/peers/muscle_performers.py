"""Performers whose every contraction is known, a camera before them, and the noise of a landmark finder.

Lengths are millimetres. The scan frame has +X to the subject's left, +Y up and +Z out of the face (the ICT face model's
own axes; its lengths are centimetres). The camera frame has x right, y down, z forward. NumPy and SciPy.
"""

import csv
import json

import numpy as np
from scipy.spatial.transform import Rotation

CENTIMETRE = 10.0
FOCAL, SIZE, DISTANCE = 700.0, (640, 480), 550.0
# Pixel centres lie at whole numbers.
CENTRE = np.array([(SIZE[0] - 1) / 2, (SIZE[1] - 1) / 2])
# Half a turn about x: from +Y up, +Z towards the viewer, to y down, z forward.
FACING = np.diag([1.0, -1.0, -1.0])
EYE_CORNERS = (33, 263)
# Shapes of the model that ARKit has not, and those of which it has one where the model has two.
FOREIGN, MERGED = ("PupilDilate", "cheekRaiser"), ("browInnerUp", "cheekPuff")
# The landmarks of the face's outline, which slide over the skin and are never scored.
OVAL = [10, 338, 297, 332, 284, 251, 389, 356, 454, 323, 361, 288, 397, 365, 379, 378, 400, 377, 152, 148, 176, 149]
OVAL += [150, 136, 172, 58, 132, 93, 234, 127, 162, 21, 54, 103, 67, 109]
LANDMARKS = 468
SCORED = ~np.isin(np.arange(LANDMARKS), OVAL)

# How a personalised performer differs from the model; muscle_takes.py tells the recipe and how it was calibrated.
FIELD = 30.0
EXPRESSIVE, AMPLITUDE, STRENGTH, TURN, LEAK, NEIGHBOURS, LOPSIDED = 1.25, 0.3, 0.4, 0.45, 0.12, 3, 0.15
# Motions larger than this, millimetres, are the jaw's, and the jaw is stiff.
LARGE = 15.0
# A landmark finder reports this part of a motion less, on average, and varies about it by this much of it.
UNDER, UNDER_SPREAD = 0.1, 0.7


def camel(name):
    """ARKit's name of an ICT shape: mouthSmile_L -> mouthSmileLeft."""
    return name.replace("_L", "Left").replace("_R", "Right")


class Model:
    """The ICT face model at MediaPipe's landmarks: `neutral` 468 x 3, `shapes` 51 x 468 x 3, ARKit's `names`."""

    def __init__(self, folder, landmark_table):
        arrays = np.load(folder / "ict_face9409_i16.npz")
        known = json.loads((folder / "ict_names.json").read_text(encoding="utf-8"))["expr_names"]
        with open(landmark_table, newline="", encoding="utf-8") as file:
            at = np.array([int(row["ict_vertex"]) for row in csv.DictReader(file)][:LANDMARKS])

        def shape(name):
            if name not in known:
                return shape(name + "_L") + shape(name + "_R")
            index = known.index(name)
            return arrays["expr_q"][index][at] * (CENTIMETRE * float(arrays["expr_scale"][index]))

        ict = [name for name in known if not name.startswith(FOREIGN + MERGED)] + list(MERGED)
        self.names = [camel(name) for name in ict]
        self.shapes = np.stack([shape(name) for name in ict])
        self.surface = arrays["neutral"] * CENTIMETRE
        self.neutral = self.surface[at]
        self.modes = arrays["ident_q"][:, at] * (CENTIMETRE * arrays["ident_scale"][:, None, None].astype(float))

    def identity(self, seed):
        """The neutral face of a person drawn from the model, within 2.5 standard deviations."""
        drawn = np.random.default_rng(seed).normal(size=len(self.modes))
        return self.neutral + np.tensordot(np.clip(drawn, -2.5, 2.5), self.modes, 1)

    def performer(self, seed, kind):
        """Neutral 468 x 3 and the 51 x 468 x 3 shapes of an `exact` or a `personalised` performer."""
        neutral = self.identity(seed)
        return neutral, self.shapes if kind == "exact" else self.personalised(np.random.default_rng([seed, 51]))

    def personalised(self, rng):
        """The shapes of one performer, 51 x 468 x 3."""
        size = np.linalg.norm(self.shapes, axis=2)
        unit = size / np.linalg.norm(size, axis=1, keepdims=True)
        overlap = unit @ unit.T - 2 * np.eye(len(size))
        side = np.tanh(self.neutral[:, 0] / CENTIMETRE)
        jaw, closed = self.names.index("jawOpen"), self.names.index("mouthClose")
        changed = []
        for index, shape in enumerate(self.shapes):
            if index == closed:
                shape = shape + self.shapes[jaw]
            large = max(1, np.linalg.norm(shape, axis=1).max() / LARGE)
            gain = EXPRESSIVE * rng.uniform(1 - AMPLITUDE, 1 + AMPLITUDE)
            gain *= 1 + STRENGTH * field(self.neutral, rng, FIELD * large)
            gain *= 1 + LOPSIDED / large * rng.uniform(-1, 1) * side
            turn = TURN / large * np.stack([field(self.neutral, rng, FIELD * large) for _ in range(3)], 1)
            near = np.argsort(-overlap[index])[:NEIGHBOURS]
            leaked = np.tensordot(rng.normal(size=NEIGHBOURS) * LEAK, self.shapes[near], 1)
            changed.append(gain[:, None] * Rotation.from_rotvec(turn).apply(shape) + leaked)
        changed[closed] -= changed[jaw]
        return np.stack(changed)


def field(points, rng, length=FIELD, waves=64):
    """A smooth random field of unit variance at the points, by random Fourier features (a Gaussian's covariance)."""
    wave = rng.normal(size=(3, waves)) / length
    return np.sqrt(2 / waves) * np.cos(points @ wave + rng.uniform(0, 2 * np.pi, waves)).sum(1)


def range_of_motion(path, names):
    """Weights, frames x 51 at 30 Hz, of a Live Link Face recording."""
    with open(path, newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    columns = [name[0].upper() + name[1:] for name in names]
    return np.clip([[float(row[column]) for column in columns] for row in rows], 0, 1)


def swings(count, rng, reach):
    """Smooth pseudo-random curves, frames x len(reach) at 30 Hz, whose farthest excursion is `reach`."""
    time = np.arange(count) / 30
    rate, phase = rng.uniform(0.08, 0.4, (4, len(reach))), rng.uniform(0, 2 * np.pi, (4, len(reach)))
    curves = np.sin(2 * np.pi * time[:, None, None] * rate + phase).sum(1)
    return curves / np.abs(curves).max(0) * reach


def head_motion(count, seed, neutral, turn=(25, 12, 8), shift=(30, 30, 30)):
    """Poses scan -> camera of a moving head: rotations T x 3 x 3 and translations T x 3.

    Yaw, pitch and roll (degrees) turn about the frame's origin, between the ears; at rest the landmarks' mean is at
    `DISTANCE` on the axis.
    """
    rng = np.random.default_rng([seed, 52])
    turned = Rotation.from_euler("YXZ", swings(count, rng, turn), degrees=True).as_matrix()
    rest = [0, 0, DISTANCE] - FACING @ neutral.mean(0)
    return FACING @ turned, rest + swings(count, rng, shift)


def projected(points, rotation, translation):
    """Pixels T x N x 2 of points T x N x 3 of the scan frame."""
    seen = points @ rotation.transpose(0, 2, 1) + translation[:, None]
    return FOCAL * seen[..., :2] / seen[..., 2:] + CENTRE


def reported(neutral, rng):
    """The part of its motion that a landmark finder reports of each landmark, 468."""
    return 1 - UNDER * (1 + UNDER_SPREAD * field(neutral, rng))


def jitter(count, neutral, level, rng, keep=0.5, length=30.0, parts=(0.4, 0.6, 0.7)):
    """Noise T x N x 2 in pixels: `level` of the distance of the eyes' outer corners, for each coordinate.

    Its parts are common to the face, smooth over it, and white; each frame keeps `keep` of the last one's.
    """
    apart = np.linalg.norm(neutral[:, None] - neutral, axis=2)
    smooth = np.linalg.cholesky(np.exp(-0.5 * (apart / length) ** 2) + 1e-6 * np.eye(len(neutral)))
    common, regional, white = np.array(parts) / np.linalg.norm(parts)
    noise, last = np.zeros((count, len(neutral), 2)), None
    for frame in noise:
        fresh = common * rng.normal(size=(1, 2)) + regional * smooth @ rng.normal(size=frame.shape)
        fresh += white * rng.normal(size=frame.shape)
        frame[:] = fresh if last is None else keep * last + np.sqrt(1 - keep**2) * fresh
        last = frame
    eyes = np.linalg.norm(np.subtract(*neutral[list(EYE_CORNERS)]))
    return level * eyes * FOCAL / DISTANCE * noise
