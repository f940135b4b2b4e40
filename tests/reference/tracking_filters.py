"""Writes tracking_filters.json: signals smoothed by others, for tests/tracking_filters.rs.

    python3 -m venv venv && venv/bin/pip install OneEuroFilter==0.2.1 numpy==2.4.6
    venv/bin/python tests/reference/tracking_filters.py

- "one_euro": Casiez's own Python class, one channel; three channels with one cutoff from their joint speed are written
  out here from the paper's algorithm 1, because the class knows one channel only.
- "parabola": numpy.polyfit of degree 2 in the window of three bandwidths, Gaussian weights, evaluated at its middle.
"""

import json
import math
import pathlib

import numpy as np
from OneEuroFilter import OneEuroFilter

RNG = np.random.default_rng(20261122)


def uneven_times(n):
    return np.cumsum(RNG.integers(20, 55, n)) * 1_000_000


def signal(times, channels):
    t = times[:, None] * 1e-9
    rate = RNG.uniform(1.0, 6.0, channels)
    steps = np.where(t > t.mean(), 4.0, 0.0)
    return np.round(5.0 * np.sin(rate * t) + steps + RNG.normal(scale=0.3, size=(len(times), channels)), 6)


def by_casiez(times, values, cutoff, beta):
    one_euro = OneEuroFilter(freq=30.0, mincutoff=cutoff, beta=beta, dcutoff=1.0)
    return [[one_euro(float(v[0]), t * 1e-9)] for t, v in zip(times.tolist(), values)]


def jointly(times, values, cutoff, beta):
    def alpha(frequency, interval):
        return 1.0 / (1.0 + 1.0 / (2.0 * math.pi * frequency * interval))

    out, speed = [values[0]], np.zeros(values.shape[1])
    for i in range(1, len(values)):
        interval = (times[i] - times[i - 1]) * 1e-9
        a = alpha(1.0, interval)
        speed = a * (values[i] - out[-1]) / interval + (1.0 - a) * speed
        a = alpha(cutoff + beta * np.linalg.norm(speed), interval)
        out.append(a * values[i] + (1.0 - a) * out[-1])
    return np.array(out).tolist()


def parabolas(times, values, bandwidth):
    out = []
    for centre in times:
        t = (times - centre) * 1e-9
        near = np.abs(t) <= 3.0 * bandwidth
        if near.sum() < 4:
            out.append(values[times == centre][0].tolist())
            continue
        # polyfit squares its weights together with the residuals.
        weights = np.exp(-0.25 * (t[near] / bandwidth) ** 2)
        out.append(np.polyfit(t[near], values[near], 2, w=weights)[-1].tolist())
    return out


def case(kind, times, values, expected, **settings):
    return {
        "kind": kind,
        **settings,
        "times": times.tolist(),
        "values": values.tolist(),
        "expected": expected,
    }


def main():
    cases = []
    for cutoff, beta in ((1.5, 0.15), (4.0, 0.6), (1.0, 0.0)):
        times = uneven_times(60)
        values = signal(times, 1)
        expected = by_casiez(times, values, cutoff, beta)
        cases.append(case("one_euro", times, values, expected, cutoff=cutoff, beta=beta))
    times = uneven_times(40)
    values = signal(times, 3)
    cases.append(case("one_euro", times, values, jointly(times, values, 1.2, 0.08), cutoff=1.2, beta=0.08))
    for bandwidth in (0.022, 0.055, 0.08):
        times = uneven_times(50)
        values = signal(times, 3)
        cases.append(case("parabola", times, values, parabolas(times, values, bandwidth), bandwidth=bandwidth))
    path = pathlib.Path(__file__).with_suffix(".json")
    path.write_text('{"cases":[\n' + ",\n".join(json.dumps(c, separators=(",", ":")) for c in cases) + "\n]}\n")
    print(f"{len(cases)} cases, {path.stat().st_size} bytes")


if __name__ == "__main__":
    main()
