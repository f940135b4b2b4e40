"""Deformation transfer (Sumner and Popovic 2004) on the faces that transfer_faces.py wrote.

Source and target share their triangles, so that correspondence costs nothing and is exact; what the method wants beside it
is the source's every vertex in every frame, where understudy has landmarks. Each triangle of the target takes over the
deformation gradient of the source's, weighted by its area, and 40 vertices of skull and neck stay where they are.

    python benches/peers/deformation_transfer.py transfer_faces

Writes a1_deformation_transfer.pc2 and a2_deformation_transfer.pc2 into each case, and prints the error: RMS error over RMS
true motion on the face, mean of the expressions. NumPy 2.2, SciPy 1.15.
"""

import argparse
import json
from pathlib import Path

import numpy as np
import scipy.sparse as sparse
from scipy.sparse.linalg import splu

from faces import read_obj, read_pc2, relative_errors, write_pc2

# How hard the anchors hold, over the mean diagonal of the system.
HOLD = 1e4


def frames(vertices, triangles):
    """T x 3 x 3, columns: two edges and the normal, as long as the root of twice the area."""
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    length = np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    return np.stack([b - a, c - a, normal / np.sqrt(length)], 2)


class DeformationTransfer:
    """Prepared for one target; every expression of every source is then one solution of the same system."""

    def __init__(self, vertices, triangles, anchors):
        self.triangles = triangles
        corners = [vertices[triangles[:, k]] for k in range(3)]
        normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
        doubled = np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-9)
        count = len(triangles)
        rows, columns, values = [], [], []
        for k in range(3):
            opposite = corners[(k + 2) % 3] - corners[(k + 1) % 3]
            slope = np.cross(normal / doubled, opposite) / doubled
            for axis in range(3):
                rows.append(3 * np.arange(count) + axis)
                columns.append(triangles[:, k])
                values.append(slope[:, axis])
        shape = (3 * count, len(vertices))
        gradient = sparse.csr_matrix(
            (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))), shape
        )
        weighted = gradient.T @ sparse.diags(np.repeat(doubled[:, 0] / 2, 3))
        system = (weighted @ gradient).tocsc()
        held = np.zeros(len(vertices))
        held[anchors] = HOLD * system.diagonal().mean()
        self.weighted = weighted.tocsr()
        self.factors = splu((system + sparse.diags(held)).tocsc())

    def carry(self, source, moved):
        """The target's displacements, S x V x 3, for a source V x 3 and what became of it, S x V x 3."""
        back = np.linalg.inv(frames(source, self.triangles) + 1e-12 * np.eye(3))
        sides = []
        for sample in moved:
            change = frames(sample, self.triangles) @ back - np.eye(3)
            sides.append(self.weighted @ change.transpose(0, 2, 1).reshape(-1, 3))
        solved = self.factors.solve(np.concatenate(sides, 1))
        return solved.reshape(len(solved), len(moved), 3).transpose(1, 0, 2)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, help="what transfer_faces.py wrote")
    folder = parser.parse_args().folder
    with open(folder / "protocol.json", encoding="utf-8") as file:
        protocol = json.load(file)
    mask = np.array(protocol["evaluation_mask"])
    mean_face = read_obj(folder / "a2_source.obj")[0], read_pc2(folder / "a2_source.pc2")
    errors = {}
    for case in protocol["cases"]:
        place = folder / case["folder"]
        target, triangles = read_obj(place / "target.obj")
        truth = read_pc2(place / "target_truth.pc2")
        transfer = DeformationTransfer(target, triangles, protocol["zero_anchors"])
        same_face = read_obj(place / "a1_source.obj")[0], read_pc2(place / "a1_source.pc2")
        for task, (source, moved) in {"A1": same_face, "A2": mean_face}.items():
            carried = target + transfer.carry(source, moved)
            write_pc2(place / f"{task.lower()}_deformation_transfer.pc2", carried)
            results = {
                "do nothing": np.broadcast_to(target, truth.shape),
                "dense copying": target + (moved - source),
                "deformation transfer": carried,
            }
            for method, result in results.items():
                found = relative_errors(result, truth, target, mask)
                errors.setdefault((method, task), []).append((case["unseen"], found))

    names = [expression["name"] for expression in protocol["expressions"]]
    print(f"{'method':22s} task  cases        mean   " + "".join(f"{name:>8s}" for name in names))
    for (method, task), rows in errors.items():
        for which, chosen in (("all", rows), ("unseen", [row for row in rows if row[0]])):
            if chosen:
                by_expression = np.mean([found for _, found in chosen], 0)
                label = f"{method:22s} {task}    {which:6s} {len(chosen):3d}   {by_expression.mean():.3f}   "
                print(label + "".join(f"{value:8.3f}" for value in by_expression))


if __name__ == "__main__":
    main()
