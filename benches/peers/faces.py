"""Files and figures that the scripts of this folder share. NumPy alone."""

import numpy as np

MAGIC = b"POINTCACHE2\0"


def triangulated(quads):
    """Two triangles for each quad, Q x 4 -> 2Q x 3; every first half stands before every second half."""
    return np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


def write_obj(path, vertices, triangles, comment):
    """Vertices V x 3 in millimetres and triangles T x 3, counted from 0 here and from 1 in the file."""
    with open(path, "w", encoding="ascii") as file:
        file.write(f"# {comment}\n")
        np.savetxt(file, vertices, "v %.5f %.5f %.5f")
        np.savetxt(file, np.asarray(triangles) + 1, "f %d %d %d")


def read_obj(path):
    """What `write_obj` wrote: vertices V x 3 and triangles T x 3."""
    rows = {"v": [], "f": []}
    with open(path, encoding="ascii") as file:
        for line in file:
            kind, *cells = line.split()
            if kind in rows:
                rows[kind].append(cells)
    return np.array(rows["v"], float), np.array(rows["f"], int) - 1


def write_pc2(path, samples):
    """Samples S x V x 3, the layout of docs/formats.md."""
    count, points, _ = samples.shape
    with open(path, "wb") as file:
        file.write(MAGIC)
        file.write(np.array([1, points], "<i4").tobytes())
        file.write(np.array([0, 1], "<f4").tobytes())
        file.write(np.array([count], "<i4").tobytes())
        file.write(np.asarray(samples, "<f4").tobytes())


def read_pc2(path):
    """Samples S x V x 3, double precision."""
    with open(path, "rb") as file:
        content = file.read()
    if content[:12] != MAGIC:
        raise SystemExit(f"{path} is no PC2 file")
    points, count = (int(np.frombuffer(content, "<i4", 1, at)[0]) for at in (16, 28))
    return np.frombuffer(content, "<f4", offset=32).reshape(count, points, 3).astype(float)


def relative_errors(moved, truth, neutral, mask):
    """For each sample the RMS error over the RMS true motion, both over the vertices of `mask`."""
    error = np.square(moved - truth)[:, mask].sum((1, 2))
    motion = np.square(truth - neutral)[:, mask].sum((1, 2))
    return np.sqrt(error / motion)
