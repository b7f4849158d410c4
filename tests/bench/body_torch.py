#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The body model in PyTorch and in Holdfast's Python module: the same body, poses and machine, in one run.

usage: body_torch.py [--build build/release] [--frames 100] [--rounds 9]

The PyTorch code is ours, in the steps of the smplx package: blend shapes, pose correctives, rigid
transforms down the tree, linear blend skinning, all frames at once, in float32; Holdfast computes in
float64. Two bodies: the embedded one, and the same with noise in every entry of its pose correctives,
which is as dense as SMPL-X's files. Prints a Markdown table, rounds of both interleaved: CPU time on one
thread, where other programs on the machine count little, and wall time on all. "Shape kept": betas do not
change from call to call, so that PyTorch need not apply them again; Holdfast sees that by itself. Needs
the Python module (-DHOLDFAST_BUILD_PYTHON=ON) and Debian's python3-torch, best beside libopenblas0-pthread.
"""
import argparse
import os
import pathlib
import statistics
import sys
import tempfile
import time

import numpy as np
import torch

HERE = pathlib.Path(__file__).resolve().parent
BODY = HERE.parents[1] / "meshes" / "body" / "holdfast_neutral.npz"
MOST_DIFFERENCE_M = 1e-5


def rodrigues(turns):
    """Axis-angle (N, 3) -> rotations (N, 3, 3)."""
    angle = torch.norm(turns + 1e-8, dim=1, keepdim=True)
    x, y, z = (turns / angle).unbind(1)
    o = torch.zeros_like(x)
    K = torch.stack([o, -z, y, z, o, -x, -y, x, o], 1).view(-1, 3, 3)
    angle = angle[:, :, None]
    return torch.eye(3) + torch.sin(angle) * K + (1 - torch.cos(angle)) * torch.bmm(K, K)


class Body:
    """The arrays of a model file, and the forward model of smplx."""

    def __init__(self, path, num_betas):
        file = np.load(path)
        tensor = lambda name: torch.from_numpy(file[name].astype(np.float32))
        self.v_template, self.regressor, self.weights = map(tensor, ("v_template", "J_regressor", "weights"))
        self.shapedirs = tensor("shapedirs")[:, :, :num_betas]
        self.posedirs = tensor("posedirs").flatten(0, 1).T.contiguous()  # (486, 3 V)
        self.parents = [-1] + file["kintree_table"][0][1:].tolist()

    def shape(self, betas):
        """betas (B, S) -> rest vertices (B, V, 3) and joints (B, 55, 3)."""
        shaped = self.v_template + torch.einsum("bl,mkl->bmk", betas, self.shapedirs)
        return shaped, torch.einsum("bik,ji->bjk", shaped, self.regressor)

    def __call__(self, poses, trans, shaped, rest):
        """poses (B, 165) -> vertices (B, V, 3), joints (B, 55, 3)."""
        count = len(poses)
        turns = rodrigues(poses.reshape(-1, 3)).view(count, -1, 3, 3)
        features = (turns[:, 1:] - torch.eye(3)).reshape(count, -1)
        posed = shaped + torch.matmul(features, self.posedirs).view(count, -1, 3)
        joints, transforms = self.rigid(turns, rest)
        weights = self.weights.unsqueeze(0).expand(count, -1, -1)
        skin = torch.matmul(weights, transforms.view(count, -1, 16)).view(count, -1, 4, 4)
        ones = torch.ones(count, posed.shape[1], 1)
        vertices = torch.matmul(skin, torch.cat([posed, ones], 2).unsqueeze(-1))[:, :, :3, 0]
        return vertices + trans[:, None], joints + trans[:, None]

    def rigid(self, turns, rest):
        """World joints (B, 55, 3), and transforms from the rest pose (B, 55, 4, 4)."""
        rest = rest.expand(len(turns), -1, -1).unsqueeze(-1)
        bones = torch.cat([rest[:, :1], rest[:, 1:] - rest[:, self.parents[1:]]], 1)
        pad = torch.nn.functional.pad
        local = torch.cat([pad(turns, [0, 0, 0, 1]), pad(bones, [0, 0, 0, 1], value=1)], 3)
        chain = [local[:, 0]]
        for joint, parent in enumerate(self.parents[1:], 1):
            chain.append(torch.matmul(chain[parent], local[:, joint]))
        world = torch.stack(chain, 1)
        moved = torch.matmul(world, pad(rest, [0, 0, 0, 1]))
        return world[:, :, :3, 3], world - pad(moved, [3, 0])


def dense_body(path):
    """The embedded body with noise in every entry of its pose correctives."""
    fields = dict(np.load(BODY))
    noise = np.random.default_rng(1).standard_normal(fields["posedirs"].shape, np.float32)
    fields["posedirs"] = fields["posedirs"].astype(np.float32) + 1e-5 * noise
    np.savez(path, **fields)
    return path


def measure(ways, rounds, clock):
    """Least and median time of each way, milliseconds: one call of each in every round."""
    times = {name: [] for name in ways}
    for run in ways.values():
        run()
    for _ in range(rounds):
        for name, run in ways.items():
            begin = clock()
            run()
            times[name].append(1e3 * (clock() - begin))
    return {name: (min(t), statistics.median(t)) for name, t in times.items()}


def ways_of(holdfast, path, frames, threads):
    """{job: {"Holdfast" | "as smplx" | "shape kept": call}}, and the largest difference of each."""
    clip = holdfast.Clip.load("demo_drink")
    turn = np.arange(frames) % len(clip.poses)
    random = np.random.default_rng(2)
    poses = clip.poses[turn] + 0.02 * random.standard_normal((frames, 165))
    trans, betas = clip.trans[turn], random.uniform(-1.0, 1.0, 10)
    model, body = holdfast.BodyModel.load(path), Body(path, len(betas))
    p, t, b = (torch.tensor(x, dtype=torch.float32) for x in (poses, trans, betas))
    kept = body.shape(b[None])
    shapes = {"as smplx": lambda: body.shape(b.expand(frames, -1)), "shape kept": lambda: kept}
    push = random.standard_normal((frames, model.num_vertices, 3))
    push_t = torch.tensor(push, dtype=torch.float32)

    def ours_both():
        model(poses, trans, betas, threads=threads)
        return model.vjp(poses, trans, betas, push, threads=threads)

    def forward(shape):
        with torch.inference_mode():
            return body(p, t, *shape())[0]

    def both(shape):
        at, by = p.clone().requires_grad_(), t.clone().requires_grad_()
        body(at, by, *shape())[0].backward(push_t)
        return at.grad, by.grad

    jobs = {
        "vertices": {"Holdfast": lambda: model(poses, trans, betas, threads=threads)[0]},
        "vertices and gradient": {"Holdfast": ours_both},
    }
    for name, shape in shapes.items():
        jobs["vertices"][name] = lambda shape=shape: forward(shape)
        jobs["vertices and gradient"][name] = lambda shape=shape: both(shape)
    vertices = jobs["vertices"]["Holdfast"]()
    gradients = ours_both()
    off = {"vertices": 0.0, "vertices and gradient": 0.0}
    for shape in shapes.values():
        off["vertices"] = max(off["vertices"], np.abs(forward(shape).numpy() - vertices).max())
        for mine, theirs in zip(gradients, both(shape)):  # relative to the largest entry
            error = np.abs(theirs.numpy() - mine).max() / np.abs(mine).max()
            off["vertices and gradient"] = max(off["vertices and gradient"], error)
    return jobs, off


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=pathlib.Path, default=HERE.parents[1] / "build" / "release")
    parser.add_argument("--frames", type=int, default=100)
    parser.add_argument("--rounds", type=int, default=9)
    arguments = parser.parse_args()
    sys.path.insert(0, str(arguments.build / "python"))
    try:
        import holdfast
    except ImportError as error:
        sys.exit(f"body_torch.py: {error}: build with -DHOLDFAST_BUILD_PYTHON=ON, or give --build")

    print(f"| {arguments.frames} frames, ms: least (median) | Holdfast, float64 | PyTorch {torch.__version__}, float32, as smplx "
          "| shape kept | times Holdfast's (medians) | largest difference |")
    print("|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        paths = {"embedded body": BODY, "dense correctives": dense_body(pathlib.Path(folder) / "dense.npz")}
        for body, path in paths.items():
            for threads in sorted({1, len(os.sched_getaffinity(0))}):
                torch.set_num_threads(threads)
                jobs, off = ways_of(holdfast, path, arguments.frames, threads)
                for job, ways in jobs.items():
                    if off[job] > MOST_DIFFERENCE_M:
                        sys.exit(f"body_torch.py: {body}, {job}: results differ by {off[job]:.1e}")
                    took = measure(ways, arguments.rounds, time.process_time if threads == 1 else time.perf_counter)
                    cells = " | ".join(f"{least:.1f} ({median:.1f})" for least, median in took.values())
                    mine = took["Holdfast"][1]
                    ratios = " and ".join(f"{took[way][1] / mine:.1f}" for way in list(took)[1:])
                    unit = " m" if job == "vertices" else ", relative"
                    clock = "1 thread, CPU" if threads == 1 else f"{threads} threads, wall"
                    print(f"| {body}, {job}; {clock} | {cells} | {ratios} | "
                          f"{off[job]:.1e}{unit} |", flush=True)


if __name__ == "__main__":
    main()
