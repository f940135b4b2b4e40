"""Writes surface_reference.json: a surface warp solved by NumPy and SciPy, for tests/deform_surface.rs.

Made with Python 3.11, NumPy 2.2.6 and SciPy 1.15.3, all in f64:

    python3 tests/reference/surface_reference.py

Cotangent weights, areas and the quadratic are written here from their definitions and solved by SuperLU; nothing is
taken from src/deform but its constants. Of all displacements d of the vertices that may move the one is sought that
makes d'(L M^-1 L + alpha L)d + rest |d|^2 + sum_h w_h |c_h d - q_h|^2 least, with w_h `GRIP` times, and rest `REST`
times, the diagonal of the first term at the handle and on average.

The mesh is a bumpy sheet of 15 x 15 vertices with a hole, whose formula stands here and in the test; the handles, their
displacements and what 36 vertices do are in the file.
"""

import json
import pathlib

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import splu

N = 15
TENSION = 0.3
GRIP = 3.0
REST = 1e-10
WEIGHTS = (1e-3, 5.0)
LEAST_AREA = 1e-3
RNG = np.random.default_rng(20261124)


def mesh():
    i = np.arange(N * N)
    x, y = (i % N).astype(float), (i // N).astype(float)
    positions = np.stack(
        [x + 0.2 * np.sin(1.3 * y), y + 0.2 * np.cos(0.9 * x), 0.8 * np.sin(0.7 * x) * np.cos(0.5 * y)], axis=1
    )
    triangles = []
    for row in range(N - 1):
        for column in range(N - 1):
            if 5 <= row < 8 and 6 <= column < 10:
                continue
            a = row * N + column
            triangles += [[a, a + 1, a + N + 1], [a, a + N + 1, a + N]]
    return positions, np.array(triangles)


def laplacian(positions, triangles):
    count = len(positions)
    weights = sp.lil_matrix((count, count))
    areas = np.zeros(count)
    for triangle in triangles:
        area = np.linalg.norm(np.cross(*(positions[triangle[1:]] - positions[triangle[0]]))) / 2
        areas[triangle] += area / 3
        for k in range(3):
            apex, a, b = triangle[k], triangle[(k + 1) % 3], triangle[(k + 2) % 3]
            u, v = positions[a] - positions[apex], positions[b] - positions[apex]
            cotangent = np.dot(u, v) / np.linalg.norm(np.cross(u, v))
            weights[a, b] += cotangent / 2
            weights[b, a] += cotangent / 2
    weights = weights.tocsr()
    edges = sp.csr_matrix((np.ones(weights.nnz), weights.indices, weights.indptr), weights.shape)
    weights.data = np.clip(weights.data, *WEIGHTS)
    areas = np.maximum(areas, LEAST_AREA * areas.mean())
    return sp.diags(np.asarray(weights.sum(axis=1)).ravel()) - weights, areas, edges


def main():
    positions, triangles = mesh()
    still = np.zeros(N * N, bool)
    still[:N] = True
    still[N - 1 :: N] = True
    handles = []
    for vertex in [20, 67, 100, 138, 184, 214]:
        handles.append(([vertex] * 3, [1.0, 0.0, 0.0]))
    # In a triangle, the last one with two corners that are still.
    for triangle, weights in [
        (50, [0.25, 0.25, 0.5]),
        (131, [0.1, 0.6, 0.3]),
        (202, [1 / 3, 1 / 3, 1 / 3]),
        (290, [0.5, 0.5, 0.0]),
        (351, [0.2, 0.2, 0.6]),
        (54, [0.3, 0.3, 0.4]),
    ]:
        handles.append((triangles[triangle].tolist(), weights))
    targets = RNG.uniform(-2, 2, (len(handles), 3)).round(3)

    stiffness, areas, edges = laplacian(positions, triangles)
    keep = np.flatnonzero(~still)
    parts = connected_components(edges[keep][:, keep], directed=False)[1]
    held = {v for vertices, weights in handles for v, w in zip(vertices, weights) if w > 0}
    reached = {parts[k] for k, v in enumerate(keep) if v in held}
    free = np.array([v for k, v in enumerate(keep) if parts[k] in reached])

    bending = (stiffness @ sp.diags(1 / areas) @ stiffness).tocsr()
    diagonal = bending.diagonal()
    mean = diagonal[free].mean()
    at = np.where(np.isin(np.arange(N * N), free), diagonal, mean)
    system = (bending + TENSION * stiffness + REST * mean * sp.identity(N * N)).tolil()
    right = np.zeros((N * N, 3))
    for (vertices, weights), target in zip(handles, targets):
        row = np.zeros(N * N)
        np.add.at(row, vertices, weights)
        grip = GRIP * sum(weight * at[vertex] for vertex, weight in zip(vertices, weights))
        own = np.flatnonzero(row)
        system[np.ix_(own, own)] += grip * np.outer(row[own], row[own])
        right += grip * np.outer(row, target)
    system = system.tocsc()[free][:, free]
    solved = splu(system).solve(right[free])
    assert np.abs(system @ solved - right[free]).max() < 1e-9

    sampled = RNG.choice(len(free), 36, replace=False)
    sampled.sort()
    reference = {
        "tension": TENSION,
        "moving": len(free),
        "handles": [
            {"vertices": [int(v) for v in vertices], "weights": weights, "moved": target.tolist()}
            for (vertices, weights), target in zip(handles, targets)
        ],
        "expected": [[int(free[k]), *solved[k].round(9).tolist()] for k in sampled],
    }
    path = pathlib.Path(__file__).with_suffix(".json")
    rows = {key: json.dumps(value) for key, value in reference.items() if not isinstance(value, list)}
    lists = {
        key: "[\n    " + ",\n    ".join(json.dumps(row) for row in value) + "\n  ]"
        for key, value in reference.items()
        if isinstance(value, list)
    }
    body = ",\n".join(f'  "{key}": {text}' for key, text in {**rows, **lists}.items())
    path.write_text("{\n" + body + "\n}\n")


main()
