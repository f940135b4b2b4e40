"""Times SciPy's bounded least squares on a frame's weights, and prints Markdown rows.

    taskset -c 0 python benches/peers/lsq_linear.py muscle_takes

Two sizes: the 16 shapes that move the 68 classic landmarks most, and all 51 at MediaPipe's 468; weights within [0,
1]; 50 frames of the takes that muscle_takes.py wrote of its personalised performers, whose motion no weights explain
exactly. A frame's time is the shortest of five solutions by one thread; matrices are made once and not counted. The
error is the RMS distance of a landmark from the solution's.
"""

import os

os.environ |= {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}

import json
import sys
import time
from pathlib import Path

import numpy as np
import scipy
from scipy.optimize import lsq_linear

from muscle_takes import read_take

FRAMES, REPEATS, FEW = 50, 5, 16
CLASSIC = [162, 234, 93, 58, 172, 136, 149, 148, 152, 377, 378, 365, 397, 288, 323, 454, 389]
CLASSIC += [70, 63, 105, 66, 107, 336, 296, 334, 293, 300, 168, 197, 5, 4, 75, 97, 2, 326, 305]
CLASSIC += [33, 160, 158, 133, 153, 144, 362, 385, 387, 263, 373, 380, 61, 39, 37, 0, 267, 269, 291]
CLASSIC += [405, 314, 17, 84, 181, 78, 82, 13, 312, 308, 317, 14, 87]


def motions(folder):
    """The true motion of 50 frames spread over the personalised takes, 50 x 468 x 3."""
    index = json.loads((folder / "takes.json").read_text(encoding="utf-8"))
    takes = [take for take in index if take["kind"] == "personalised" and take["noise"] == 0 and not take["under"]]
    truth = np.concatenate([read_take(folder / take["file"])[1]["truth"] for take in takes]).astype(float)
    return truth[np.linspace(0, len(truth) - 1, FRAMES).astype(int)]


def timed(matrix, goal, method):
    """Shortest time in microseconds, and the solution's weights."""
    taken = []
    for _ in range(REPEATS):
        start = time.perf_counter()
        solved = lsq_linear(matrix, goal, (0, 1), method=method)
        taken.append(1e6 * (time.perf_counter() - start))
    return min(taken), solved.x


def row(matrix, goals, method):
    times, errors = [], []
    for goal in goals:
        taken, weights = timed(matrix, goal, method)
        times.append(taken)
        errors.append(3 * np.square(matrix @ weights - goal).mean())
    rows, unknowns = matrix.shape
    print(
        f"| SciPy {scipy.__version__} lsq_linear, {method} | {unknowns} x {rows} | {np.median(times):.0f} "
        f"| {max(times):.0f} | {np.sqrt(np.mean(errors)):.3f} |"
    )


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    folder = Path(sys.argv[1])
    truth, shapes = motions(folder), read_take(folder / "basis.bin")[1]["shapes"].astype(float)
    moves_most = np.argsort(-np.square(shapes[:, CLASSIC]).sum((1, 2)))[:FEW]
    print("| bounded least squares | unknowns x rows | median, µs | slowest, µs | error, mm |\n|---|---|--:|--:|--:|")
    for chosen, landmarks in ((np.sort(moves_most), CLASSIC), (np.arange(len(shapes)), range(truth.shape[1]))):
        matrix = shapes[np.ix_(chosen, landmarks)].reshape(len(chosen), -1).T.copy()
        goals = truth[:, landmarks].reshape(len(truth), -1)
        for method in ("bvls", "trf"):
            row(matrix, goals, method)


if __name__ == "__main__":
    main()
