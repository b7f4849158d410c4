#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The networks of IMoS in PyTorch and in Holdfast: the same weights, one core, one run.

usage: imos_torch.py [--build build/release]

Prints a Markdown table of CPU time for each network, and how far the motions of both differ after 15
key frames. Needs holdfast_imos_bench, the Python module (-DHOLDFAST_BUILD_BENCHMARKS=ON
-DHOLDFAST_BUILD_PYTHON=ON) and Debian's python3-torch, best beside libopenblas0-pthread. The object's
poses are given. PyTorch runs as it comes ("eager").
"""
import argparse
import json
import math
import pathlib
import subprocess
import sys
import tempfile
import time

import numpy as np
import torch

HERE = pathlib.Path(__file__).resolve().parent
BUILD = pathlib.Path(sys.argv[sys.argv.index("--build") + 1] if "--build" in sys.argv else HERE.parents[1] / "build" / "release")
sys.path.append(str(BUILD / "python"))

from holdfast.train import imos_networks, networks  # noqa: E402

HISTORY = 4


class Networks(imos_networks.Networks):
    """What is trained, rolled out with the object's poses given."""

    def __init__(self, config, present=False):
        super().__init__(config, present)
        self.order = [int(j) for j in config["arm_order"].split(",")]

    def parts(self):
        return {"arms": self.arms, "body": self.body} if self.two else {"body": self.body}

    def roll(self, condition, poses, roots, objects, noise):
        """(N, C), (N, 4, 132), (N, 4, 3), (N, T, 9), (N, T - 4, Z) -> poses (N, T, 132), roots."""
        c, n = self.c, len(condition)
        poses, roots = list(poses.unbind(1)), list(roots.unbind(1))
        slots = torch.cat([torch.arange(6) + 6 * j for j in self.order])
        phi = self.body.condition(condition)
        if self.two:
            own = condition if c.arms_see_class else torch.cat((condition[:, :10], condition[:, 64:]), -1)
            phi_arms = self.arms.condition(own)
        for t in range(HISTORY, objects.shape[1]):
            past, eps = poses[-HISTORY:], noise[:, t - HISTORY]
            held = objects[:, t - HISTORY : t]
            told = [condition.new_full((n, 1), min(t / 14.0, 1.0))] * int(c.sees_progress)
            if self.two:
                eps_arms, eps = eps[:, : c.arms_latent], eps[:, c.arms_latent :]
                arms_past = torch.cat([p[:, slots] for p in past], -1)
                seen = torch.cat([held[:, :, : self.seen].flatten(1)] + told, -1)
                z = self.arms.encode(torch.cat((arms_past, seen, phi_arms), -1), "past").sample(eps_arms)
                made = self.arms.decode(torch.cat((phi_arms, z, arms_past, seen), -1)) + arms_past[:, -36:]
                arms = torch.zeros_like(made)
                arms = arms.index_copy(1, slots - 96, made)
            x = [self.attend(p[:, : self.pose_size]) for p in past]
            if self.beside:
                x += [p[:, : self.pose_size] for p in past]
            if self.two:
                x += [p[:, 96:] for p in past] + ([arms] if c.body_sees_arms_now else [])
            x += [] if c.object_now == "absent" else [held[:, -1]]
            x += [held.flatten(1)] + (roots[-HISTORY:] if self.rooted else []) + told + [phi]
            x = torch.cat(x, -1)
            y = self.body.decode(torch.cat((self.body.encode(x, "past").sample(eps), x), -1))
            if c.body_makes == "step":
                y = torch.cat((y[:, : self.pose_size] + poses[-1][:, : self.pose_size], y[:, self.pose_size :]), -1)
            poses.append(torch.cat((y[:, :96], arms), -1) if self.two else y[:, :132])
            roots.append(roots[-1] + y[:, -3:] if self.rooted else roots[-1])
        return torch.stack(poses, 1), torch.stack(roots, 1)


OPTIONS = ("modules self_attention attended_past sees_progress action_embedding action_size arms_see_class arms_object body_sees_arms_now "
           "object_now arm_order root body_makes object_rotation block_width arms_condition arms_first arms_second "
           "arms_decoder arms_latent body_condition body_first body_second body_decoder body_latent "
           "attention_layers attention_heads attention_width").split()


def networks_of(path):
    texts, tensors = networks.read_safetensors(path)
    both = Networks({k: texts[k] for k in OPTIONS})
    left = both.load_state_dict(tensors, strict=False)
    own = [k for k in left.missing_keys if not k.endswith(("num_batches_tracked", "action_embedding.weight"))]
    assert not own and not left.unexpected_keys, (own, left.unexpected_keys)
    return both


def cpu_time(run, seconds=3.0):
    """Least CPU time of a call, milliseconds: other programs on the machine do not count."""
    run()
    best, begin = math.inf, time.monotonic()
    while time.monotonic() - begin < seconds:
        start = time.process_time()
        run()
        best = min(best, time.process_time() - start)
    return 1e3 * best


def ours(program):
    """CPU time, milliseconds, by benchmark."""
    out = subprocess.run(
        [program, "--benchmark_format=json", "--benchmark_repetitions=5", "--benchmark_filter=^KeyFrames/"],
        capture_output=True, text=True, check=True,
    ).stdout
    found = {}
    for row in json.loads(out)["benchmarks"]:
        if row["run_type"] == "iteration":
            found[row["run_name"]] = min(found.get(row["run_name"], math.inf), row["cpu_time"])
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=pathlib.Path, default=BUILD)
    program = parser.parse_args().build / "tests" / "bench" / "holdfast_imos_bench"
    if not program.exists():
        sys.exit(f"imos_torch.py: no {program}: build with -DHOLDFAST_BUILD_BENCHMARKS=ON, or give --build")
    torch.set_num_threads(1)
    print(f"| 15 key frames, CPU time, ms | Holdfast | PyTorch {torch.__version__} | ratio | largest difference |")
    print("|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder, torch.inference_mode():
        folder = pathlib.Path(folder)
        subprocess.run([program, "--scene", folder], check=True)
        held = ours(program)
        for name in ("paper", "compact"):
            both = networks_of(folder / f"{name}.safetensors")
            scene = {k: torch.from_numpy(v) for k, v in np.load(folder / f"{name}.npz").items()}
            given = [scene[k] for k in ("conditions", "poses", "roots", "objects", "noise")]
            poses, roots = both.roll(*given)
            worst = max((poses - scene["motions"]).abs().max().item(), (roots - scene["root_tracks"]).abs().max().item())
            for count in (1, 32):
                many = [x[:1].expand(count, *x.shape[1:]).contiguous() for x in given]
                theirs = cpu_time(lambda: both.roll(*many))
                mine = held[f"KeyFrames/{name}/{count}"]
                print(f"| {name}, N = {count} | {mine:.2f} | {theirs:.1f} | {theirs / mine:.1f} | {worst:.1e} |", flush=True)


if __name__ == "__main__":
    main()
