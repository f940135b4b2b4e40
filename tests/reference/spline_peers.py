"""Times VTK and SciPy on the sizes of benches/spline.rs and prints milliseconds, fastest and median.

Same environment as spline_reference.py (VTK 9.3.1, SciPy 1.15.3, NumPy 1.26.4), every library on one thread:

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 taskset -c 1 venv/bin/python tests/reference/spline_peers.py

"fit" solves for the coefficients. "apply" moves the vertices with them, which is what a library without a
precomputed matrix does in every frame. "B @ Q" is NumPy's product with that matrix precomputed, f32.
"""

import time

import numpy as np
import vtk
from scipy.interpolate import RBFInterpolator
from vtk.util.numpy_support import numpy_to_vtk

SIZES = [(35_000, 110), (6_393, 500)]


def face(n):
    i = np.arange(n)
    depth = (i + 0.5) / n
    ring, turn = np.sqrt(1 - depth**2), i * 2.399963229728653
    return np.stack([75 * ring * np.cos(turn), 110 * ring * np.sin(turn) + 40, 60 * depth], 1)


def report(name, run, times=15):
    taken = []
    for _ in range(times):
        start = time.perf_counter()
        run()
        taken.append(1e3 * (time.perf_counter() - start))
    print(f"{name:40s} fastest {min(taken):9.3f}  median {np.median(taken):9.3f}")


def vtk_points(rows):
    points = vtk.vtkPoints()
    points.SetData(numpy_to_vtk(rows, deep=True))
    return points


def main():
    for vertices, n in SIZES:
        centres, mesh = face(n), face(vertices)
        i = np.arange(n)
        values = centres + np.stack([np.sin(i), np.cos(2.0 * i), np.full(n, 0.5)], 1)
        size = f"{vertices} x {n}"

        def fit_vtk():
            transform = vtk.vtkThinPlateSplineTransform()
            transform.SetBasisToR()
            transform.SetSourceLandmarks(vtk_points(centres))
            transform.SetTargetLandmarks(vtk_points(values))
            transform.Update()
            return transform

        transform, source = fit_vtk(), vtk_points(mesh)
        report(f"VTK fit, R, {n}", fit_vtk)
        report(f"VTK apply, R, {size}", lambda: transform.TransformPoints(source, vtk.vtkPoints()))

        def fit_scipy():
            return RBFInterpolator(centres, values, kernel="linear", degree=1)

        f = fit_scipy()
        report(f"SciPy fit, linear, {n}", fit_scipy)
        report(f"SciPy apply, linear, {size}", lambda: f(mesh))

        b = np.random.default_rng(0).random((vertices, n), dtype=np.float32)
        q = values.astype(np.float32)
        report(f"NumPy B @ Q, {size}", lambda: b @ q, 200)


if __name__ == "__main__":
    main()
