"""Writes marker_*.c3d and marker_files.json: takes written by others, for src/capture/marker_c3d.rs.

    python3 -m venv venv && venv/bin/pip install ezc3d==1.7.2 c3d==0.6.0 numpy==2.4.6
    venv/bin/python tests/reference/marker_files.py

- "marker_floats.c3d": ezc3d; floating point, an analog channel at three times the rate, a marker that is lost for
  some frames and one that no frame shows.
- "marker_integers.c3d": the `c3d` package; 16-bit integers with a scale, a marker that is lost for some frames.

Expected places are what the two packages read from their own files.
"""

import json
import pathlib

import c3d
import ezc3d
import numpy as np

HERE = pathlib.Path(__file__).parent
RNG = np.random.default_rng(20261124)
NAMES = ["Forehead_M", "Mouth_Lend", "Mouth_Rend", "Chin", "Lost"]


def places(frames, markers):
    start = RNG.uniform(-200, 200, (1, markers, 3))
    return (start + RNG.normal(scale=2, size=(frames, markers, 3))).round(2)


def row(place):
    return None if np.isnan(place).any() else [float(v) for v in place]


def floats():
    points = places(9, 5)
    points[3:5, 1] = np.nan
    points[:, 4] = np.nan
    file = ezc3d.c3d()
    file["header"]["points"]["frame_rate"] = 60.0
    file["parameters"]["POINT"]["RATE"]["value"] = [60.0]
    file["parameters"]["POINT"]["UNITS"]["value"] = ["mm"]
    file["parameters"]["POINT"]["LABELS"]["value"] = NAMES
    file["parameters"]["ANALOG"]["RATE"]["value"] = [180.0]
    file["parameters"]["ANALOG"]["LABELS"]["value"] = ["sync"]
    file["data"]["points"] = np.concatenate([points.transpose(2, 1, 0), np.ones((1, 5, 9))])
    file["data"]["analogs"] = RNG.uniform(-5, 5, (1, 1, 27))
    path = HERE / "marker_floats.c3d"
    file.write(str(path))
    read = ezc3d.c3d(str(path))["data"]["points"][:3].transpose(2, 1, 0)
    return case(path, 60.0, NAMES, read)


def integers():
    points = places(7, 4)
    writer = c3d.Writer(point_rate=120.0, point_scale=0.01)
    writer.set_point_labels(NAMES[:4])
    for f, frame in enumerate(points):
        values = np.zeros((4, 5))
        values[:, :3] = frame
        if f in (2, 6):
            values[2] = [0, 0, 0, -1, -1]
        writer.add_frames((values, np.empty((0, 0))))
    path = HERE / "marker_integers.c3d"
    with path.open("wb") as file:
        writer.write(file)
    with path.open("rb") as file:
        read = np.array([p for _, p, _ in c3d.Reader(file).read_frames()])
    lost = read[:, :, 3] < 0
    read = read[:, :, :3].astype(float)
    read[lost] = np.nan
    return case(path, 120.0, NAMES[:4], read)


def case(path, rate, names, read):
    return {
        "file": path.name,
        "rate": rate,
        "names": names,
        "frames": [[row(place) for place in frame] for frame in read],
    }


def main():
    cases = [floats(), integers()]
    path = HERE / "marker_files.json"
    path.write_text("[\n" + ",\n".join(json.dumps(c, separators=(",", ":")) for c in cases) + "\n]\n")
    for c in cases:
        print(c["file"], (HERE / c["file"]).stat().st_size, c["frames"][2])


if __name__ == "__main__":
    main()
