#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Writes random body models of SMPL-X's full size for body_model_load (numpy needed):

    make_full_size_models.py FOLDER

10,475 vertices, 400 shape directions, dense blend shapes: float32 and float64, each stored and
deflated. The numbers mean nothing; only their amount is that of the real files.
"""

import pathlib
import sys

import numpy as np

V, S = 10475, 400
BODY = [-1, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 9, 9, 12, 13, 14, 16, 17, 18, 19, 15, 15, 15]
PARENTS = BODY + [w if k % 3 == 0 else f + k - 1 for w, f in ((20, 25), (21, 40)) for k in range(15)]

out = pathlib.Path(sys.argv[1])
out.mkdir(parents=True, exist_ok=True)
rng = np.random.default_rng(1)
weights = rng.random((V, 55)) ** 20
regressor = rng.random((55, V)) ** 20
model = {
    "v_template": rng.standard_normal((V, 3)),
    "f": rng.integers(0, V, (20908, 3)).astype(np.uint32),
    "shapedirs": 0.01 * rng.standard_normal((V, 3, S), np.float32).astype(np.float64),
    "posedirs": 0.001 * rng.standard_normal((V, 3, 486), np.float32).astype(np.float64),
    "J_regressor": regressor / regressor.sum(1, keepdims=True),
    "weights": weights / weights.sum(1, keepdims=True),
    "kintree_table": np.array([PARENTS, range(55)], np.int64).astype(np.uint32),
}
for kind in (np.float32, np.float64):
    fields = {k: v.astype(kind) if v.dtype == np.float64 else v for k, v in model.items()}
    np.savez(out / f"{np.dtype(kind).name}.npz", **fields)
    np.savez_compressed(out / f"{np.dtype(kind).name}_deflated.npz", **fields)
