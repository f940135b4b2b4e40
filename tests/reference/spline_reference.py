"""Writes spline_reference.json: splines fitted by VTK, SciPy and Kornia, for tests/spline_oracles.rs.

Made with Python 3.11, NumPy 1.26.4, SciPy 1.15.3, VTK 9.3.1, Kornia 0.7.4 and PyTorch 1.13 (Debian 12's
python3-torch), all in f64:

    apt-get install -y --no-install-recommends python3-torch
    /usr/bin/python3 -m venv --system-site-packages venv
    venv/bin/pip install numpy==1.26.4 scipy==1.15.3 vtk==9.3.1
    venv/bin/pip install --no-deps kornia==0.7.4 kornia_rs packaging
    venv/bin/python tests/reference/spline_reference.py

How the oracles' conventions map onto ours (U and lambda as in src/spline):

- VTK's R2LogR is r^2 ln r, half of r^2 ln r^2: the weights double, the map is the same. Regularisation 0.
- SciPy adds `smoothing` to the diagonal of the positive definite form of its kernel, at the scale of the points.
  linear: U = -r, so K - lambda I with lambda = smoothing. thin_plate_spline: U = r^2 ln r, so lambda = 2 smoothing.
  cubic: lambda = smoothing. multiquadric: U = -sqrt(1 + (eps r)^2), so s = 1/eps and lambda = smoothing / eps.
  gaussian: exp(-(eps r)^2), so s = 1/eps and lambda = smoothing.
  Ours has one stiffness for each centre, SciPy's one for all: they are compared on a lattice, where every nearest
  neighbour is equally far.
- Kornia's is U = 0.5 r^2 ln(r^2 + 1e-8): the 1e-8 bends it away from the true kernel by up to 5e-9 in U. Its
  get_tps_transform centres the kernels on the *values* (rows at the centres, columns at the values, side conditions
  at the centres), so what it returns is not the spline of Bookstein or of 000 eq. 4.16. The distance function is
  therefore replaced while it solves, so that rows and columns are both the centres; kernel, solver and evaluation
  are Kornia's own.
"""

import json
import pathlib

import kornia
import kornia.geometry.transform.thin_plate_spline as tps
import numpy as np
import scipy
import torch
import vtk
from scipy.interpolate import RBFInterpolator

RNG = np.random.default_rng(20261122)


def face(n):
    """n points on a half ellipsoid of a face's size in mm, a quarter of a metre off the origin."""
    d = RNG.normal(size=(n, 3))
    d[:, 2] = np.abs(d[:, 2])
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    return d * [75.0, 110.0, 60.0] + RNG.normal(scale=2.0, size=(n, 3)) + [30.0, 120.0, -250.0]


def case(oracle, kernel, smoothing, centres, values, queries, expected):
    return {
        "oracle": oracle,
        "kernel": kernel,
        "lambda": smoothing,
        "dimension": centres.shape[1],
        "centres": centres.tolist(),
        "values": values.tolist(),
        "queries": queries.tolist(),
        "expected": np.asarray(expected).tolist(),
    }


def by_vtk(kernel, centres, values, queries):
    source, target = vtk.vtkPoints(), vtk.vtkPoints()
    for points, rows in ((source, centres), (target, values)):
        points.SetDataTypeToDouble()
        for row in rows:
            points.InsertNextPoint(*row)
    transform = vtk.vtkThinPlateSplineTransform()
    if kernel == "Linear":
        transform.SetBasisToR()
    else:
        transform.SetBasisToR2LogR()
    transform.SetSourceLandmarks(source)
    transform.SetTargetLandmarks(target)
    transform.Update()
    out = [transform.TransformPoint(*q) for q in queries]
    return case("vtk", kernel, 0.0, centres, values, queries, out)


NAMES = {
    "Linear": "linear",
    "ThinPlate": "thin_plate_spline",
    "Cubic": "cubic",
    "Hardy": "multiquadric",
    "Gaussian": "gaussian",
}


def by_scipy(kernel, centres, values, queries, smoothing=0.0, spacing=None):
    name = NAMES[kernel]
    scale = {"Linear": 1.0, "ThinPlate": 2.0, "Cubic": 1.0, "Hardy": spacing, "Gaussian": 1.0}[kernel]
    epsilon = None if spacing is None else 1.0 / spacing
    f = RBFInterpolator(centres, values, kernel=name, degree=1, smoothing=smoothing, epsilon=epsilon)
    return case("scipy", kernel, smoothing * scale, centres, values, queries, f(queries))


def by_kornia(centres, values, queries):
    t = lambda a: torch.tensor(a, dtype=torch.float64)[None]
    distance = tps._pair_square_euclidean
    tps._pair_square_euclidean = lambda a, _: distance(a, a)
    try:
        weights, affine = tps.get_tps_transform(t(centres), t(values))
    finally:
        tps._pair_square_euclidean = distance
    out = tps.warp_points_tps(t(queries), t(centres), weights, affine)[0].numpy()
    return case("kornia", "ThinPlate", 0.0, centres, values, queries, out)


def main():
    cases = []
    centres = face(30)
    values = centres + RNG.normal(scale=4.0, size=centres.shape)
    queries = face(12)
    for kernel in ("Linear", "ThinPlate"):
        cases.append(by_vtk(kernel, centres, values, queries))
    for kernel, smoothing in (("Linear", 15.0), ("ThinPlate", 3000.0), ("Cubic", 5e5)):
        cases.append(by_scipy(kernel, centres, values, queries))
        cases.append(by_scipy(kernel, centres, values, queries, smoothing))

    lattice = np.stack(np.meshgrid(*[np.arange(3) * 20.0] * 3, indexing="ij"), -1).reshape(-1, 3)
    lattice = np.delete(lattice, [4, 13, 26], axis=0)
    values = lattice + RNG.normal(scale=4.0, size=lattice.shape)
    queries = RNG.uniform(0.0, 40.0, size=(12, 3))
    for kernel in ("Hardy", "Gaussian"):
        for smoothing in (0.0, 0.5):
            cases.append(by_scipy(kernel, lattice, values, queries, smoothing, spacing=20.0))

    plane = RNG.uniform(-1.0, 1.0, size=(20, 2))
    values = plane + RNG.normal(scale=0.1, size=plane.shape)
    queries = RNG.uniform(-1.0, 1.0, size=(12, 2))
    cases.append(by_kornia(plane, values, queries))
    cases.append(by_scipy("ThinPlate", plane, values, queries))
    cases.append(by_scipy("ThinPlate", plane, values, queries, 0.05))

    versions = {
        "numpy": np.__version__,
        "scipy": scipy.__version__,
        "vtk": vtk.vtkVersion().GetVTKVersion(),
        "kornia": kornia.__version__,
        "torch": torch.__version__,
    }
    path = pathlib.Path(__file__).with_suffix(".json")
    lines = ",\n".join(json.dumps(c) for c in cases)
    path.write_text(f'{{"versions": {json.dumps(versions)},\n"cases": [\n{lines}\n]}}\n')
    print(f"{len(cases)} cases, {path.stat().st_size} bytes: {versions}")


if __name__ == "__main__":
    main()
