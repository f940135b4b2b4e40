"""Writes haar_reference.json: a 16x16 decomposition by PyWavelets, for src/appearance/haar.rs.

    python3 -m venv venv && venv/bin/pip install PyWavelets==1.9.0 numpy==2.4.6
    venv/bin/python tests/reference/haar_reference.py
"""

import json
import pathlib

import numpy as np
import pywt

RNG = np.random.default_rng(20261124)

samples = np.round(RNG.normal(size=(16, 16)), 4)
array, _ = pywt.coeffs_to_array(pywt.wavedec2(samples, "haar", level=4))
out = {"samples": samples.ravel().tolist(), "coefficients": np.round(array, 6).ravel().tolist()}
pathlib.Path(__file__).with_name("haar_reference.json").write_text(json.dumps(out) + "\n")
