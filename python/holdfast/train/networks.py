# SPDX-License-Identifier: MIT
"""Networks with parameters named like the tensors of weights files."""

import json
import os
import pathlib
import re
import tempfile

import numpy as np
import torch
from torch import nn
from torch.nn import functional

import holdfast

_TYPES = {"F32": np.float32, "F16": np.float16, "F64": np.float64, "I64": np.int64}


def read_safetensors(path):
    """(texts, {name: float32 tensor}) of a safetensors file. Raises holdfast.Error for damaged files."""
    try:
        data = pathlib.Path(path).read_bytes()
    except OSError as error:
        raise holdfast.Error(f"{path}: {error.strerror}. Check the path") from None
    try:
        size = int.from_bytes(data[:8], "little")
        header, body = json.loads(data[8 : 8 + size]), data[8 + size :]
        texts = header.pop("__metadata__", {})
        tensors = {}
        for name, entry in header.items():
            begin, end = entry["data_offsets"]
            values = np.frombuffer(body[begin:end], _TYPES[entry["dtype"]]).reshape(entry["shape"])
            tensors[name] = torch.from_numpy(values.astype(np.float32))
    except (ValueError, KeyError, TypeError, AttributeError, OverflowError):
        raise holdfast.Error(f"{path}: is not a safetensors file of numbers. Give another file") from None
    return texts, tensors


def write_atomically(path, data):
    """Writes bytes to `path` atomically."""
    path = pathlib.Path(path)
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(data)
        os.chmod(name, 0o644)
        os.replace(name, path)
    except BaseException:
        os.unlink(name)
        raise


def write_safetensors(path, tensors, texts, half=lambda name, tensor: False):
    """Writes {name: tensor} as float32, or as float16 if half(name, tensor). Wide types come first
    and names ascend, as in files of the library."""
    arrays = {}
    for name in sorted(tensors):
        values = tensors[name].detach().cpu().numpy()
        narrow = half(name, tensors[name])
        arrays[name] = np.ascontiguousarray(values.astype("<f2" if narrow else "<f4"))
        if not np.isfinite(arrays[name]).all():
            raise holdfast.Error(f"{path}: '{name}' has values that are not finite in this type")
    arrays = dict(sorted(arrays.items(), key=lambda item: -item[1].itemsize))
    header, reached = {}, 0
    if texts:
        header["__metadata__"] = dict(sorted(texts.items()))
    for name, values in arrays.items():
        header[name] = {"dtype": "F16" if values.itemsize == 2 else "F32",
                        "shape": list(tensors[name].shape),
                        "data_offsets": [reached, reached + values.nbytes]}
        reached += values.nbytes
    text = json.dumps(header, separators=(",", ":"), ensure_ascii=False).encode()
    text += b" " * (-len(text) % 8)
    write_atomically(path, len(text).to_bytes(8, "little") + text
                     + b"".join(values.tobytes() for values in arrays.values()))


class Block(nn.Module):
    """h, z -> h + W2 silu(W1 norm(h) + Wz z + b1) + b2."""

    def __init__(self, width, latent):
        super().__init__()
        self.norm = nn.LayerNorm(width)
        self.first = nn.Linear(width, width)
        if latent:
            self.latent = nn.Linear(latent, width, bias=False)
        self.second = nn.Linear(width, width)

    def forward(self, h, z):
        inner = self.first(self.norm(h))
        if z is not None:
            inner = inner + self.latent(z)
        return h + self.second(functional.silu(inner))


class Residual(nn.Module):
    """The residual network (generator/nn/network_weights.h); blocks see the first `latent` inputs."""

    def __init__(self, size, latent, width, blocks, output):
        super().__init__()
        self.latent_size = latent
        self.input = nn.Linear(size, width)
        self.blocks = nn.ModuleList(Block(width, latent) for _ in range(blocks))
        self.output_norm = nn.LayerNorm(width)
        self.output = nn.Linear(width, output)

    def forward(self, x):
        z, h = x[:, : self.latent_size] if self.latent_size else None, self.input(x)
        for block in self.blocks:
            h = block(h, z)
        return self.output(self.output_norm(h))


class Chain(nn.Module):
    """The published chain of layers: dropout, layer norm, linear, ReLU (none after the last)."""

    def __init__(self, widths):
        super().__init__()
        parts = []
        for size, output in zip(widths, widths[1:]):
            parts += [nn.Dropout(0.0), nn.LayerNorm(size), nn.Linear(size, output), nn.ReLU()]
        self.layers = nn.Sequential(*parts[:-1])

    def forward(self, x):
        return self.layers(x)


def network_of(tensors, where="network"):
    """A Residual or a Chain with these tensors, by names without a prefix."""
    try:
        if "input.weight" in tensors:
            (width, size), latent = tensors["input.weight"].shape, tensors.get("blocks.0.latent.weight")
            blocks = sum(bool(re.fullmatch(r"blocks\.\d+\.first\.weight", name)) for name in tensors)
            network = Residual(size, 0 if latent is None else latent.shape[1], width, blocks,
                               len(tensors["output.bias"]))
        else:
            count = sum(name.endswith(".weight") for name in tensors) // 2
            weights = [tensors[f"layers.{4 * k + 2}.weight"] for k in range(count)]
            network = Chain([weights[0].shape[1], *(len(weight) for weight in weights)])
        network.load_state_dict({name: torch.as_tensor(values) for name, values in tensors.items()})
    except (KeyError, IndexError, RuntimeError):
        raise holdfast.Error(f"{where}: is not a network of layers or residual blocks. Give weights "
                             "written by holdfast.train") from None
    return network


def prefixed(tensors, prefix):
    return {f"{prefix}.{name}": values for name, values in tensors.items()}


def under(tensors, prefix):
    """The tensors "prefix.name", by name."""
    return {name[len(prefix) + 1 :]: values for name, values in tensors.items()
            if name.startswith(prefix + ".")}


class Critic:
    """Least-squares discriminator of real and generated motions (Mao et al. 2017): +1 and -1, with a
    gradient penalty at real ones (Mescheder et al. 2018, weight 2)."""

    def __init__(self, network, rate):
        self.network = network
        self.optimizer = torch.optim.Adam(network.parameters(), lr=rate, betas=(0.5, 0.99))

    def learn(self, real, score_real, score_own, belief):
        """One step: `score_real` of `real`, which takes gradients, towards +1 and `belief` down.
        Returns the fraction of scores with the correct sign."""
        slope, = torch.autograd.grad(score_real.sum(), real, create_graph=True)
        loss = (score_real - 1.0).square().mean() + belief + 2.0 * slope.square().sum(1).mean()
        self.optimizer.zero_grad()
        loss.backward()
        self.optimizer.step()
        right = (score_real > 0).float().mean() + (score_own < 0).float().mean()
        return 0.5 * right.item()


def doubt_of(scores):
    """Mean of (score - 1)^2 / 4: 0 for motions classified as real, 1 for others."""
    return 0.25 * (scores - 1.0).square().mean()


def belief_of(scores):
    """Mean of (score + 1)^2: the critic's loss on generated motions."""
    return (scores + 1.0).square().mean()
