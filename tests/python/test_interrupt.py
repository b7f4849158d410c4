# SPDX-License-Identifier: MIT
"""Ctrl-C ends every call that takes long, and another one is none the worse."""
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

import holdfast

SETUP = """
import numpy as np, holdfast
def ball(n):  # a mesh of 2 n (n - 1) triangles
    up, round = np.meshgrid(np.linspace(0, np.pi, n + 1)[1:-1], np.linspace(0, 2 * np.pi, n + 1)[:-1],
                            indexing="ij")
    side = np.stack([np.sin(up) * np.cos(round), np.sin(up) * np.sin(round), np.cos(up)], -1)
    vertices = 0.05 * np.vstack([side.reshape(-1, 3), [[0, 0, 1], [0, 0, -1]]])
    a = np.arange(n * (n - 1)).reshape(n - 1, n)
    b = np.roll(a, -1, 1)
    faces = [np.stack([a[:-1], a[1:], b[:-1]], -1), np.stack([b[:-1], a[1:], b[1:]], -1)]
    ends = [np.stack([b[0] * 0 + len(vertices) - 2, a[0], b[0]], -1),
            np.stack([b[0] * 0 + len(vertices) - 1, b[-1], a[-1]], -1)]
    return vertices, np.vstack([part.reshape(-1, 3) for part in faces + ends])
many = np.random.default_rng(1).random((12000, 3))
near = np.full((12000, 12000), 0.5)
long = holdfast.Clip(np.zeros((60000, 165)), np.zeros((60000, 3)))
"""
CALLS = {
    "decimate": "holdfast.decimate(ball(500))",
    "grid": "holdfast.SignedDistance(ball(100), cell=0.0004)",
    "voxels": "holdfast.intersection_volume(ball(100), ball(120), False, voxel=0.0002)",
    "exact": "holdfast.intersection_volume(ball(400), ball(380))",
    "pair_distances": "holdfast.pair_distances(many, many)",
    "distance_energy": "holdfast.distance_energy(many, many, near)",
    "contact_energy": "holdfast.contact_energy(many, many, near, 2.0)",
    "resample": "long.resample(240.0)",
    "save": "long.save('long.npz')",
    "fit": "holdfast.fit('demo_drink', 'mug')",
    "fit a large mesh": "holdfast.fit('demo_drink', ball(300))",
    "frame fitter": "holdfast.FrameFitter(ball(300))",
    "grasp": "holdfast.grasp('mug')",
    "grasps": "holdfast.grasps('mug', 100000, apart_cm=0.1, apart_angle_deg=57.0)",
    "synthesize": "holdfast.synthesize('drink', 'mug', samples=64)",
    "reach": "holdfast.reach([[1.5, 1, 1.1], [-3, 1, 1]], samples=400)",
}


@pytest.mark.parametrize("name", CALLS)
def test_ctrl_c(name, tmp_path):
    script = SETUP + f"""
print("ready", flush=True)
try:
    {CALLS[name]}
    print("done", flush=True)
except KeyboardInterrupt:
    print("stopped", flush=True)
assert len(holdfast.decimate("apple", 100)[0]) == 100
print("well", flush=True)
"""
    environment = {**os.environ, "PYTHONPATH": str(Path(holdfast.__file__).parents[1])}
    with subprocess.Popen([sys.executable, "-c", script], cwd=tmp_path, env=environment,
                          stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout.readline() == "ready\n"
        time.sleep(0.3)
        sent = time.monotonic()
        process.send_signal(signal.SIGINT)
        said = process.stdout.readline()
        took = time.monotonic() - sent
        assert said in ("stopped\n", "done\n")  # a fast machine may be done
        assert took < 60.0  # not stuck; on an idle machine it is within a second
        assert process.stdout.readline() == "well\n"
        process.kill()  # what was left behind would be waited for
