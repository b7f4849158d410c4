#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The networks of IMoS in PyTorch and in Holdfast: the same weights, one core, one run.

usage: imos_torch.py [--build build/release]

Prints a Markdown table of CPU time for each network, and how far the motions of both differ after 15
key frames. Needs holdfast_imos_bench (-DHOLDFAST_BUILD_BENCHMARKS=ON) and Debian's python3-torch,
best beside libopenblas0-pthread. The object's poses are given. PyTorch runs as it comes ("eager").
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
from torch import nn

HERE = pathlib.Path(__file__).resolve().parent
HISTORY = 4
leaky = nn.LeakyReLU(0.2)


class Block(nn.Module):
    def __init__(self, size, width, output):
        super().__init__()
        self.fc1, self.bn1 = nn.Linear(size, width), nn.BatchNorm1d(width)
        self.fc2, self.bn2 = nn.Linear(width, output), nn.BatchNorm1d(output)
        if size != output:
            self.fc3 = nn.Linear(size, output)

    def forward(self, x):
        skip = leaky(self.fc3(x)) if hasattr(self, "fc3") else x
        return leaky(skip + self.bn2(self.fc2(leaky(self.bn1(self.fc1(x))))))


class Heads(nn.Module):
    def __init__(self, joints, heads, width):
        super().__init__()
        self.heads = heads
        for name in ("w_qs", "w_ks", "w_vs"):
            setattr(self, name, nn.Linear(6, heads * width, bias=False))
        self.w_combine = nn.Linear(heads * width, 6, bias=False)
        self.layer_norm = nn.LayerNorm([joints, 6], eps=1e-6)

    def forward(self, q, x):
        split = lambda y: y.view(*y.shape[:2], self.heads, -1).transpose(1, 2)
        Q, K, V = split(self.w_qs(q)), split(self.w_ks(x)), split(self.w_vs(x))
        weights = torch.softmax(Q @ K.transpose(2, 3) / Q.shape[-1] ** 0.5, dim=-1)
        return self.layer_norm(q + self.w_combine((weights @ V).transpose(1, 2).flatten(2)))


class Layer(nn.Module):
    def __init__(self, *sizes):
        super().__init__()
        self.attn = Heads(*sizes)


class SelfAttention(nn.Module):
    def __init__(self, layers, joints, heads, width):
        super().__init__()
        self.attention_layers = nn.ModuleList(Layer(joints, heads, width) for _ in range(layers))
        place = torch.arange(joints, dtype=torch.float64)[:, None]
        angle = place / 10000.0 ** (2.0 * torch.arange(6, dtype=torch.float64) / 6)
        even = torch.arange(6) % 2 == 0
        self.code = torch.where(even, torch.sin(angle), torch.cos(angle))

    def forward(self, pose):
        x = pose.view(len(pose), -1, 6)
        x = x + 1e-3 * self.code.to(x)
        q = x
        for layer in self.attention_layers:
            q = layer.attn(q, x)
        return q.flatten(1)


class Synthesis(nn.Module):
    """One module, by the names of the published ones."""

    def __init__(self, condition, phi, past, first, second, latent, decoder, output, width, present=None):
        super().__init__()
        self.enc_bn0, self.enc_rb0 = nn.BatchNorm1d(condition), Block(condition, width, phi)
        if present:
            self.enc_bn1, self.enc_rb1 = nn.BatchNorm1d(present), Block(present, width, first)
            self.enc_rb2 = Block(present + first, width, second)
            self.mu_present, self.sigma_present = nn.Linear(second, latent), nn.Linear(second, latent)
        self.enc_bn1_past, self.enc_rb1_past = nn.BatchNorm1d(past), Block(past, width, first)
        self.enc_rb2_past = Block(past + first, width, second)
        self.mu_past, self.sigma_past = nn.Linear(second, latent), nn.Linear(second, latent)
        self.dec_bn1, self.dec_rb1 = nn.BatchNorm1d(past + latent), Block(past + latent, width, decoder)
        self.dec_rb2 = Block(past + latent + decoder, width, output)

    def condition(self, x):
        return self.enc_rb0(self.enc_bn0(x))

    def latent(self, past, noise):
        x = self.enc_bn1_past(past)
        h = self.enc_rb2_past(torch.cat((x, self.enc_rb1_past(x)), -1))
        return self.mu_past(h) + noise * self.sigma_past(h)

    def decode(self, y):
        return self.dec_rb2(torch.cat((y, self.dec_rb1(self.dec_bn1(y))), -1))


class Networks:
    """Both modules (or one) of a configuration: texts as in a weights file."""

    def __init__(self, config, present=False):
        self.c = c = {k: int(v) if v.isdigit() else v for k, v in config.items()}
        self.two, self.rooted = c["modules"] == "two", c["root"] == "predicted"
        self.joints = 16 if self.two else 22
        self.seen = 9 if c["arms_object"] == "pose" else 3
        self.tells = 1 if c["sees_progress"] == "yes" else 0
        self.order = [int(j) for j in config["arm_order"].split(",")]
        width = c["block_width"]
        self.arms = None
        if self.two:
            condition = 10 + c["action_size"] + (54 if c["arms_see_class"] == "yes" else 0)
            self.arms = Synthesis(
                condition, c["arms_condition"], 4 * (36 + self.seen) + self.tells + c["arms_condition"], c["arms_first"],
                c["arms_second"], c["arms_latent"], c["arms_decoder"], 36, width,
                36 + self.seen + c["arms_condition"] if present else None)
        self.beside = c["self_attention"] == "yes" and c["attended_past"] == "beside"
        past = 4 * (6 * self.joints * (2 if self.beside else 1) + 9) + self.tells + c["body_condition"]
        past += 4 * 36 + (36 if c["body_sees_arms_now"] == "yes" else 0) if self.two else 0
        past += (0 if c["object_now"] == "absent" else 9) + (12 if self.rooted else 0)
        self.body = Synthesis(
            64 + c["action_size"], c["body_condition"], past, c["body_first"], c["body_second"], c["body_latent"],
            c["body_decoder"], 6 * self.joints + (3 if self.rooted else 0), width)
        if c["self_attention"] == "yes":
            self.body.attention_model = SelfAttention(
                c["attention_layers"], self.joints, c["attention_heads"], c["attention_width"])
        for module in self.modules().values():
            module.eval()

    def modules(self):
        return {"arms": self.arms, "body": self.body} if self.two else {"body": self.body}

    def load(self, tensors):
        for prefix, module in self.modules().items():
            own = {k.removeprefix(prefix + "."): v for k, v in tensors.items() if k.startswith(prefix + ".")}
            left = module.load_state_dict(own, strict=False)
            left = [k for k in left.missing_keys if not k.endswith("num_batches_tracked")] + left.unexpected_keys
            assert not left, left

    def double(self):
        for module in self.modules().values():
            module.double()
        return self

    def roll(self, condition, poses, roots, objects, noise):
        """(N, C), (N, 4, 132), (N, 4, 3), (N, T, 9), (N, T - 4, Z) -> poses (N, T, 132), roots."""
        c, n = self.c, len(condition)
        poses, roots = list(poses.unbind(1)), list(roots.unbind(1))
        slots = torch.cat([torch.arange(6) + 6 * j for j in self.order])
        phi = self.body.condition(condition)
        if self.two:
            own = condition if c["arms_see_class"] == "yes" else torch.cat((condition[:, :10], condition[:, 64:]), -1)
            phi_arms = self.arms.condition(own)
        for t in range(HISTORY, objects.shape[1]):
            past, eps = poses[-HISTORY:], noise[:, t - HISTORY]
            held = objects[:, t - HISTORY : t]
            told = [condition.new_full((n, 1), min(t / 14.0, 1.0))] * self.tells
            if self.two:
                eps_arms, eps = eps[:, : c["arms_latent"]], eps[:, c["arms_latent"] :]
                arms_past = torch.cat([p[:, slots] for p in past], -1)
                seen = torch.cat([held[:, :, : self.seen].flatten(1)] + told, -1)
                z = self.arms.latent(torch.cat((arms_past, seen, phi_arms), -1), eps_arms)
                made = self.arms.decode(torch.cat((phi_arms, z, arms_past, seen), -1)) + arms_past[:, -36:]
                arms = torch.zeros_like(made)
                arms = arms.index_copy(1, slots - 96, made)
            attend = getattr(self.body, "attention_model", lambda p: p)
            x = [attend(p[:, : 6 * self.joints]) for p in past]
            if self.beside:
                x += [p[:, : 6 * self.joints] for p in past]
            if self.two:
                x += [p[:, 96:] for p in past] + ([arms] if c["body_sees_arms_now"] == "yes" else [])
            x += [] if c["object_now"] == "absent" else [held[:, -1]]
            x += [held.flatten(1)] + (roots[-HISTORY:] if self.rooted else []) + told + [phi]
            x = torch.cat(x, -1)
            y = self.body.decode(torch.cat((self.body.latent(x, eps), x), -1))
            if c["body_makes"] == "step":
                y = torch.cat((y[:, : 6 * self.joints] + poses[-1][:, : 6 * self.joints], y[:, 6 * self.joints :]), -1)
            poses.append(torch.cat((y[:, :96], arms), -1) if self.two else y[:, :132])
            roots.append(roots[-1] + y[:, -3:] if self.rooted else roots[-1])
        return torch.stack(poses, 1), torch.stack(roots, 1)


def read_safetensors(path):
    data = path.read_bytes()
    size = int.from_bytes(data[:8], "little")
    header, body = json.loads(data[8 : 8 + size]), data[8 + size :]
    texts = header.pop("__metadata__", {})
    return texts, {
        name: torch.from_numpy(np.frombuffer(body[slice(*e["data_offsets"])], np.float32).reshape(e["shape"]).copy())
        for name, e in header.items()
    }


OPTIONS = ("modules self_attention attended_past sees_progress action_embedding action_size arms_see_class arms_object body_sees_arms_now "
           "object_now arm_order root body_makes object_rotation block_width arms_condition arms_first arms_second "
           "arms_decoder arms_latent body_condition body_first body_second body_decoder body_latent "
           "attention_layers attention_heads attention_width").split()


def networks_of(path):
    texts, tensors = read_safetensors(path)
    networks = Networks({k: texts[k] for k in OPTIONS})
    tensors.pop("action_embedding.weight", None)
    networks.load(tensors)
    return networks


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
    parser.add_argument("--build", type=pathlib.Path, default=HERE.parents[1] / "build" / "release")
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
            networks = networks_of(folder / f"{name}.safetensors")
            scene = {k: torch.from_numpy(v) for k, v in np.load(folder / f"{name}.npz").items()}
            given = [scene[k] for k in ("conditions", "poses", "roots", "objects", "noise")]
            poses, roots = networks.roll(*given)
            worst = max((poses - scene["motions"]).abs().max().item(), (roots - scene["root_tracks"]).abs().max().item())
            for count in (1, 32):
                many = [x[:1].expand(count, *x.shape[1:]).contiguous() for x in given]
                theirs = cpu_time(lambda: networks.roll(*many))
                mine = held[f"KeyFrames/{name}/{count}"]
                print(f"| {name}, N = {count} | {mine:.2f} | {theirs:.1f} | {theirs / mine:.1f} | {worst:.1e} |", flush=True)


if __name__ == "__main__":
    main()
