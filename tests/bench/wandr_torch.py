#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""WANDR's closed loop in PyTorch and in Holdfast: the same networks, one core, one run.

usage: wandr_torch.py [--build build/release]

Prints a Markdown table of CPU time per step for each network, and how far the motions of both differ after 8 s. Needs
holdfast_wandr_bench, the Python module (-DHOLDFAST_BUILD_BENCHMARKS=ON -DHOLDFAST_BUILD_PYTHON=ON) and Debian's
python3-torch, best beside libopenblas0-pthread: with the reference BLAS PyTorch's products are several times slower. The loop is
written with batched tensor operations throughout, the wrist by the seven joints that move it.
PyTorch runs as it comes ("eager") and compiled (traced and frozen); the faster counts.
"""
import argparse
import json
import math
import pathlib
import subprocess
import sys
import tempfile
import time
import warnings

import numpy as np
import torch

HERE = pathlib.Path(__file__).resolve().parent
BUILD = pathlib.Path(sys.argv[sys.argv.index("--build") + 1] if "--build" in sys.argv else HERE.parents[1] / "build" / "release")
sys.path.append(str(BUILD / "python"))

from holdfast.train import motion, networks  # noqa: E402

STEPS = 240
WRIST_CHAIN = (0, 3, 6, 9, 14, 17, 19, 21)  # pelvis to right wrist


class Step(torch.nn.Module):
    """s, d, z, goal, eta -> s', d'. States (N, 135) in their own units, deltas normalized."""

    def __init__(self, tensors, rest_joints, detached_heading=False):
        super().__init__()
        self.detached_heading = detached_heading  # in gradients, as the authors' code has it
        self.decoder = networks.network_of(networks.under(tensors, "decoder")).eval()
        stat = lambda what, *names: torch.cat([tensors[f"statistics.{n}.{what}"] for n in names])
        pose = ("body_transl", "body_orient_xy", "body_pose")
        delta = ("body_transl_delta_pelv_xy", "body_orient_delta", "body_pose_delta")
        self.register_buffer("pose_mean", stat("mean", *pose)[2:])
        self.register_buffer("pose_scale", stat("std", *pose)[2:] + 1e-5)
        self.register_buffer("delta_mean", stat("mean", *delta))
        self.register_buffer("delta_scale", stat("std", *delta) + 1e-5)
        bones = [rest_joints[b] - rest_joints[a] for a, b in zip(WRIST_CHAIN, WRIST_CHAIN[1:])]
        self.register_buffer("pelvis", rest_joints[0].clone())
        self.register_buffer("bones", torch.stack(bones))

    def forward(self, state, delta, z, goal, eta):
        n = state.shape[0]
        p, R = state[:, :3], motion.rotations_of(state[:, 3:].view(n, 22, 6))
        root = R[:, 0]
        azimuth = torch.atan2(root[:, 1, 0], root[:, 0, 0])
        c, s, o = torch.cos(azimuth), torch.sin(azimuth), torch.zeros_like(azimuth)
        Z = torch.stack((c, -s, o, s, c, o, o, o, o + 1), dim=-1).view(n, 3, 3)
        upright = motion.six_of(Z.transpose(1, 2) @ root)
        Z = Z.detach() if self.detached_heading else Z
        Zt = Z.transpose(1, 2)
        local = lambda v: (Zt @ v.unsqueeze(-1)).squeeze(-1)

        pelvis = p + self.pelvis
        wrist, A = pelvis, root
        for k, bone in enumerate(self.bones):
            wrist = wrist + A @ bone
            if k + 2 < len(WRIST_CHAIN):
                A = A @ R[:, WRIST_CHAIN[k + 1]]
        velocity = local(goal - wrist) / (eta / 30.0 + 1e-5)
        way = goal - pelvis
        norm = way.norm(dim=-1, keepdim=True)
        flat = torch.tensor([1.0, 1.0, 0.0])
        walk = local(2.0 * (1.0 - torch.exp(-norm)) * way / norm) * flat
        wanted = torch.nn.functional.normalize(way * flat, dim=-1)
        turn = local(wanted) + torch.tensor([0.0, 1.0, 0.0])

        upright = torch.cat((upright[:, :3], o.unsqueeze(-1), upright[:, 4:]), dim=-1)
        features = torch.cat((p[:, 2:], upright, motion.six_of(R[:, 1:]).flatten(1)), dim=-1)
        features = (features - self.pose_mean) / self.pose_scale
        u = self.decoder(torch.cat((z, features, delta, velocity, walk, turn), dim=-1))

        d = u * self.delta_scale + self.delta_mean
        p = p + (Z @ d[:, :3].unsqueeze(-1)).squeeze(-1)
        R = R @ motion.rotations_of(d[:, 3:].view(n, 22, 6))
        return torch.cat((p, motion.six_of(R).flatten(1)), dim=-1), u


def cpu_time(run, seconds=2.0):
    """Least CPU time of a call, microseconds: other programs on the machine do not count."""
    run()
    best, begin = math.inf, time.monotonic()
    while time.monotonic() - begin < seconds:
        start = time.process_time()
        run()
        best = min(best, time.process_time() - start)
    return 1e6 * best


def ours(program, network):
    """CPU times of one network, microseconds, by what was measured and how often."""
    measured = "Step|DecoderAlone|EightSeconds"
    out = subprocess.run(
        [program, "--benchmark_format=json", "--benchmark_repetitions=5",
         f"--benchmark_filter=^({measured})/{network}/(1|1/1|64|750)(/process_time.*)?$"],
        capture_output=True, text=True, check=True,
    ).stdout
    found = {}
    for row in json.loads(out)["benchmarks"]:
        if row["run_type"] == "iteration":
            name = row["run_name"].split("/process_time")[0].replace(f"/{network}", "")
            unit = {"us": 1.0, "ms": 1e3}[row["time_unit"]]
            found[name] = min(found.get(name, math.inf), unit * row["cpu_time"])
    return found


def every_motion(program, network):
    """Seconds by the clock of the 3,750 motions of 8 s, two threads."""
    out = subprocess.run(
        [program, "--benchmark_format=json", f"--benchmark_filter=^EightSeconds/{network}/3750/"],
        capture_output=True, text=True, check=True,
    ).stdout
    (row,) = json.loads(out)["benchmarks"]
    return row["real_time"] / 1e3


def compare(network, program, folder):
    scene = {name: torch.from_numpy(array) for name, array in np.load(folder / f"{network}.npz").items()}
    step = Step(networks.read_safetensors(folder / f"{network}.safetensors")[1], scene["rest_joints"]).eval()

    state, delta = scene["states"], scene["previous_deltas"]
    worst = {}
    for t in range(STEPS):
        state, delta = step(state, delta, scene["latents"][:, t], scene["goals"], torch.tensor(float(STEPS - t)))
        worst[t + 1] = (state - scene["motions"][:, t + 1]).abs().max().item()

    held = ours(program, network)

    def row(name, mine, module, inputs):
        eager = cpu_time(lambda: module(*inputs))
        with torch.inference_mode(False), torch.no_grad():
            copies = [x.clone() for x in inputs]
            compiled = torch.jit.freeze(torch.jit.trace(module, copies, check_trace=False))
            for _ in range(3):
                compiled(*copies)
            traced = cpu_time(lambda: compiled(*copies))
        ratio = min(eager, traced) / held[mine]
        print(f"| {name} | {held[mine]:.0f} | {eager:.0f} | {traced:.0f} | {ratio:.1f} |", flush=True)

    print(f"\n{network}\n\n| CPU time, us | Holdfast | PyTorch {torch.__version__} eager | compiled | ratio |")
    print("|---|---|---|---|---|")
    for count in (1, 64, 750):
        many = lambda x: x[:1].expand(count, *x.shape[1:]).contiguous()
        inputs = (many(scene["states"]), many(scene["previous_deltas"]), many(scene["latents"][:, 0]),
                  many(scene["goals"]), torch.tensor(240.0))
        if count < 750:
            row(f"decoder alone, N = {count}", f"DecoderAlone/{count}", step.decoder, (torch.randn(count, 341),))
        row(f"one step, N = {count}", f"Step/{count}", step, inputs)
    print(f"\n240 frames, N = 1: {held['EightSeconds/1/1'] / 1e3:.1f} ms. "
          f"3,750 motions of 240 frames, two threads: {every_motion(program, network):.1f} s.")
    print(f"Largest difference of states: {worst[1]:.1e} after one step, {worst[STEPS]:.1e} after {STEPS}.")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=pathlib.Path, default=BUILD)
    options = parser.parse_args()
    program = options.build / "tests" / "bench" / "holdfast_wandr_bench"
    if not program.exists():
        sys.exit(f"wandr_torch.py: no {program}: build with -DHOLDFAST_BUILD_BENCHMARKS=ON, or give --build")
    torch.set_num_threads(1)
    warnings.filterwarnings("ignore", category=torch.jit.TracerWarning)
    with tempfile.TemporaryDirectory() as folder, torch.inference_mode():
        subprocess.run([program, "--scene", folder], check=True)
        for network in ("published", "residual256x4", "residual512x4"):
            compare(network, program, pathlib.Path(folder))


if __name__ == "__main__":
    main()
