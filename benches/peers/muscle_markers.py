"""Real motion of 41 optical markers (AnimFace, 60 Hz), as displacements of MediaPipe's landmarks nearest to them.

The recordings' axes are the scan frame's, X to the subject's left, in centimetres: markers on the ICT face model's mean
surface, fitted with a free scale, come out 3 % larger than it.
"""

import csv

import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from muscle_performers import CENTIMETRE, LANDMARKS

# Markers that stay with the skull in each recording; what is left of their motion is .4 and .7 mm.
EYES = ["NoseTop", "Leye_Inside", "Leye_Outside", "Reye_Outside"]
STEADY = {
    "Jaw": EYES + ["ForeHead_M", "ForeHead_L", "ForeHead_R"],
    "Eyebrows": EYES + ["Reye_Inside", "NoseHead", "Lcheek_Outside", "Rcheek_Outside"],
}
# Landmarks near some of the markers, to start the fit from.
STARTS = {"NoseTop": 6, "NoseHead": 4, "NoseHead_L": 358, "NoseHead_R": 129, "Leye_Inside": 362, "Reye_Inside": 133}
STARTS |= {"Leye_Outside": 263, "Reye_Outside": 33, "Mouth_Lend": 291, "Mouth_Rend": 61, "Mouth_Up": 0, "Chin": 152}
# Landmarks on the rims of lids and inside the lips, where no marker can be glued.
RIMS = [33, 7, 163, 144, 145, 153, 154, 155, 133, 173, 157, 158, 159, 160, 161, 246]
RIMS += [263, 249, 390, 373, 374, 380, 381, 382, 362, 398, 384, 385, 386, 387, 388, 466]
RIMS += [78, 191, 80, 81, 82, 13, 312, 311, 310, 415, 308, 324, 318, 402, 317, 14, 87, 178, 88, 95]
# Frames at rest before the first motion; millimetres from the middle within which a landmark belongs to no side.
REST, MIDDLE, ROUNDS = 30, 2.0, 100
MIRROR = np.array([-1.0, 1.0, 1.0])


def similarity(moved, fixed, scaled):
    """Scale, rotation and shift of the best scale * R x + shift from `moved` to `fixed`."""
    a, b = moved - moved.mean(0), fixed - fixed.mean(0)
    rotation = Rotation.align_vectors(b, a)[0].as_matrix()
    scale = (b * (a @ rotation.T)).sum() / (a**2).sum() if scaled else 1.0
    return scale, rotation, fixed.mean(0) - scale * rotation @ moved.mean(0)


def placed(points, scale, rotation, shift):
    return scale * points @ rotation.T + shift


def recording(path):
    """Names of the markers, their places T x 41 x 3 in millimetres without the head's motion, and those at rest."""
    with open(path, newline="", encoding="utf-8") as file:
        header, *rows = csv.reader(file)
    names = [column.removesuffix("_x") for column in header[1::3]]
    places = np.array(rows, float)[:, 1:].reshape(len(rows), -1, 3) * CENTIMETRE
    steady = [names.index(name) for name in STEADY[path.stem]]
    rest = np.median(places[:REST], axis=0)
    return names, np.stack([placed(frame, *similarity(frame[steady], rest[steady], False)) for frame in places]), rest


def opposite(names):
    """For each marker the one at its place on the other side."""
    return [names.index(name.translate(str.maketrans("LR", "RL"))) for name in names]


def into_scan_frame(names, rest, model):
    """Rotation and shift from the recording's frame to the model's, and the scale that would make them of one size.

    Markers are made symmetrical and fitted to the mean surface, point to nearest point, so that left and right agree.
    """
    other = opposite(names)
    upright = similarity(rest[other] * MIRROR, rest, False)
    symmetrical = (rest + placed(rest[other] * MIRROR, *upright)) / 2
    starts = [names.index(name) for name in STARTS]
    fit = similarity(symmetrical[starts], model.neutral[list(STARTS.values())], True)
    tree = cKDTree(model.surface)
    for _ in range(ROUNDS):
        nearest = model.surface[tree.query(placed(symmetrical, *fit))[1]]
        fit = similarity(symmetrical, (nearest + nearest[other] * MIRROR) / 2, True)
    scale, rotation, shift = fit
    return rotation, shift / scale, scale


def nearest_landmarks(names, rest, model, scale):
    """For each marker a landmark of its own, on its side of the face and mirrored on the other."""
    other = np.array(opposite(names))
    twin = cKDTree(model.neutral).query(model.neutral * MIRROR)[1]
    landmarks = np.full(len(names), -1)
    sides = np.array([name.translate(str.maketrans("", "", "LR")) != name for name in names])
    left = sides & (rest[:, 0] > rest[other, 0])
    open_skin, aside = ~np.isin(np.arange(LANDMARKS), RIMS), model.neutral[:, 0]
    paired = (aside > MIDDLE) & (twin[twin] == np.arange(LANDMARKS))
    for markers, free in ((~sides, open_skin & (np.abs(aside) <= MIDDLE)), (left, open_skin & paired)):
        markers, free = np.flatnonzero(markers), np.flatnonzero(free)
        symmetrical = scale * (rest[markers] + rest[other[markers]] * MIRROR) / 2
        apart = np.linalg.norm(symmetrical[:, None] - model.neutral[free], axis=2)
        row, column = linear_sum_assignment(apart**2)
        landmarks[markers[row]] = free[column]
    landmarks[other[left]] = twin[landmarks[left]]
    return landmarks


def warped(points, controls, goals):
    """The points under the thin-plate spline (kernel r, with an affine part) that takes the controls to their goals."""

    def terms(at):
        return np.hstack([np.linalg.norm(at[:, None] - controls, axis=2), np.ones((len(at), 1)), at])

    rows = terms(controls)
    system = np.zeros((len(controls) + 4,) * 2)
    system[: len(controls)] = rows
    system[len(controls) :, : len(controls)] = rows[:, len(controls) :].T
    return terms(points) @ np.linalg.solve(system, np.vstack([goals, np.zeros((4, 3))]))


def marker_take(path, model):
    """Neutral 468 x 3, truth T x 468 x 3 at 30 Hz (NaN where no marker is), markers, and how they fitted."""
    names, places, rest = recording(path)
    rotation, shift, scale = into_scan_frame(names, rest, model)
    rest, places = (placed(points, 1.0, rotation, shift) for points in (rest, places[::2]))
    landmarks = nearest_landmarks(names, rest, model, scale)
    truth = np.full((len(places), LANDMARKS, 3), np.nan)
    truth[:, landmarks] = places - rest
    neutral = warped(model.neutral / scale, model.neutral[landmarks] / scale, rest)
    markers = [{"name": name, "landmark": int(landmark)} for name, landmark in zip(names, landmarks, strict=True)]
    away = np.linalg.norm(scale * rest - model.neutral[landmarks], axis=1)
    found = f"x {scale:.3f} is the mean face; markers {np.median(away):.1f} mm from landmarks, at most {away.max():.1f}"
    return neutral, truth, markers, found
