# SPDX-License-Identifier: MIT
"""The networks of IMoS (Ghosh et al. 2023), parameters by the names of weights files
(generator/imos/config.h)."""

import types

import torch
from torch import nn
from torch.nn import functional

import holdfast

HISTORY, KEY_FRAMES, ACTIONS, OBJECTS = 4, 15, 29, 54
POSE, TRUNK, ARMS, OBJECT = 132, 96, 36, 9  # numbers: joints 0..21, 0..15, 16..21, and the object's


def leaky(x):
    return functional.leaky_relu(x, 0.2)


class Block(nn.Module):
    def __init__(self, size, width, output, dropped):
        super().__init__()
        self.fc1, self.bn1 = nn.Linear(size, width), nn.BatchNorm1d(width)
        self.fc2, self.bn2 = nn.Linear(width, output), nn.BatchNorm1d(output)
        if size != output:
            self.fc3 = nn.Linear(size, output)
        self.dropped = dropped

    def forward(self, x):
        h = self.bn2(self.fc2(self.dropped(leaky(self.bn1(self.fc1(x))))))
        return leaky((leaky(self.fc3(x)) if hasattr(self, "fc3") else x) + h)


class Heads(nn.Module):
    def __init__(self, joints, heads, width, dropped):
        super().__init__()
        self.heads, self.dropped = heads, dropped
        for name in ("w_qs", "w_ks", "w_vs"):
            setattr(self, name, nn.Linear(6, heads * width, bias=False))
        self.w_combine = nn.Linear(heads * width, 6, bias=False)
        self.layer_norm = nn.LayerNorm([joints, 6], eps=1e-6)

    def forward(self, q, x):
        split = lambda y: y.view(*y.shape[:2], self.heads, -1).transpose(1, 2)
        Q, K, V = split(self.w_qs(q)), split(self.w_ks(x)), split(self.w_vs(x))
        weights = self.dropped(torch.softmax(Q / Q.shape[-1] ** 0.5 @ K.transpose(2, 3), dim=-1))
        heard = self.w_combine((weights @ V).transpose(1, 2).flatten(2))
        return self.layer_norm(q + self.dropped(heard))


class SelfAttention(nn.Module):
    def __init__(self, layers, joints, *sizes):
        super().__init__()
        self.attention_layers = nn.ModuleList()
        for _ in range(layers):
            self.attention_layers.append(nn.Module())
            self.attention_layers[-1].attn = Heads(joints, *sizes)
        place = torch.arange(joints, dtype=torch.float64)[:, None]
        angle = place / 10000.0 ** (2.0 * torch.arange(6, dtype=torch.float64) / 6)
        even = torch.arange(6) % 2 == 0
        self.code = 1e-3 * torch.where(even, torch.sin(angle), torch.cos(angle))

    def forward(self, pose):
        x = pose.view(len(pose), -1, 6)
        q = x = x + self.code.to(x)
        for layer in self.attention_layers:
            q = layer.attn(q, x)
        return q.flatten(1)


class Latents:
    def __init__(self, mu, sigma):
        self.mu, self.sigma = mu, sigma

    def sample(self, noise):
        return self.mu + self.sigma * noise

    def divergence(self):
        """From N(0, 1), the mean over rows and dimensions."""
        square = self.sigma * self.sigma
        return -0.5 * (1.0 + torch.log(square + 1e-12) - self.mu * self.mu - square).mean()


class Synthesis(nn.Module):
    """One module, with parameters named like the published ones."""

    def __init__(self, condition, phi, past, first, second, latent, decoder, output, width, present, dropped):
        super().__init__()
        block = lambda size, output: Block(size, width, output, dropped)
        self.enc_bn0, self.enc_rb0 = nn.BatchNorm1d(condition), block(condition, phi)
        if present:
            self.enc_bn1, self.enc_rb1 = nn.BatchNorm1d(present), block(present, first)
            self.enc_rb2 = block(present + first, second)
            self.mu_present, self.sigma_present = nn.Linear(second, latent), nn.Linear(second, latent)
        self.enc_bn1_past, self.enc_rb1_past = nn.BatchNorm1d(past), block(past, first)
        self.enc_rb2_past = block(past + first, second)
        self.mu_past, self.sigma_past = nn.Linear(second, latent), nn.Linear(second, latent)
        self.dec_bn1, self.dec_rb1 = nn.BatchNorm1d(past + latent), block(past + latent, decoder)
        self.dec_rb2 = block(past + latent + decoder, output)

    def condition(self, x):
        return self.enc_rb0(self.enc_bn0(x))

    def encode(self, x, when):
        """when: "past", or "present", which sees the target."""
        suffix = "_past" if when == "past" else ""
        part = lambda name: getattr(self, name)
        x = part("enc_bn1" + suffix)(x)
        h = part("enc_rb2" + suffix)(torch.cat((x, part("enc_rb1" + suffix)(x)), -1))
        return Latents(part("mu_" + when)(h), part("sigma_" + when)(h))

    def decode(self, y):
        return self.dec_rb2(torch.cat((y, self.dec_rb1(self.dec_bn1(y))), -1))


class Networks(nn.Module):
    """Both modules (or one) of a configuration: texts as in a weights file. Begins in evaluation
    mode; `train()` has batch norms take the batch's statistics and uses `dropout` (draws of
    `draws`, run.Draws)."""

    def __init__(self, config, present=False):
        super().__init__()
        self.c = c = types.SimpleNamespace(**{
            k: int(v) if v.isdigit() else {"yes": True, "no": False}.get(v, v) for k, v in config.items()})
        self.two, self.rooted = c.modules == "two", c.root == "predicted"
        self.pose_size = TRUNK if self.two else POSE
        self.seen = OBJECT if c.arms_object == "pose" else 3
        self.beside = c.self_attention and c.attended_past == "beside"
        self.dropout, self.draws = 0.0, None
        tells = int(c.sees_progress)
        if self.two:
            condition = 10 + c.action_size + (OBJECTS if c.arms_see_class else 0)
            self.arms = Synthesis(
                condition, c.arms_condition, HISTORY * (ARMS + self.seen) + tells + c.arms_condition, c.arms_first,
                c.arms_second, c.arms_latent, c.arms_decoder, ARMS, c.block_width,
                ARMS + self.seen + c.arms_condition if present else None, self.dropped)
        past = HISTORY * (self.pose_size * (2 if self.beside else 1) + OBJECT) + tells + c.body_condition
        past += HISTORY * ARMS + (ARMS if c.body_sees_arms_now else 0) if self.two else 0
        past += (0 if c.object_now == "absent" else OBJECT) + (3 * HISTORY if self.rooted else 0)
        self.body = Synthesis(
            10 + OBJECTS + c.action_size, c.body_condition, past, c.body_first, c.body_second, c.body_latent,
            c.body_decoder, self.pose_size + (3 if self.rooted else 0), c.block_width, None, self.dropped)
        if c.self_attention:
            self.body.attention_model = SelfAttention(
                c.attention_layers, self.pose_size // 6, c.attention_heads, c.attention_width, self.dropped)
        self.action_embedding = nn.Embedding.from_pretrained(
            torch.zeros(ACTIONS, c.action_size), freeze=c.action_embedding != "learned")
        self.eval()

    def dropped(self, x):
        if self.dropout == 0.0 or not self.training:
            return x
        kept = 1.0 - self.dropout
        return x * self.draws.bernoulli(x.shape, kept) / kept

    def attend(self, pose):
        return self.body.attention_model(pose) if self.c.self_attention else pose

    def tensors(self):
        return {name: values for name, values in self.state_dict().items()
                if not name.endswith("num_batches_tracked")}

    def load(self, tensors, where):
        """Raises holdfast.Error if a tensor is missing or has another shape."""
        for name, own in self.tensors().items():
            if name not in tensors or tensors[name].shape != own.shape:
                raise holdfast.Error(f"{where}: has no '{name}' of shape {tuple(own.shape)}. Give the "
                                     "best.safetensors of a training of the same configuration")
            own.copy_(torch.as_tensor(tensors[name]))
