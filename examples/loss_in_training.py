# SPDX-License-Identifier: MIT
"""Energy terms as a loss in PyTorch: a small network learns finger angles for a hand that holds a mug.

The network sees body and arms of a frame; its loss is how far the hand's distances to the mug are
from those of the first frame (E_d), and how deep the skin is in the mug. Gradients of both, and of
the body model, are Holdfast's.
"""
import argparse

import torch

import holdfast
import holdfast.torch as losses

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("--steps", type=int, default=200)
parser.add_argument("--frames", type=int, default=16)
arguments = parser.parse_args()

held = holdfast.fit(holdfast.Clip.load("demo_drink")[: arguments.frames], "mug", hand="right")
clip = held.clip
assert clip.object
model = holdfast.BodyModel.load()
body = losses.Body(model, model.hand_vertex_ids("right"))
mug, _ = holdfast.decimate(held.object, 300)
inside = holdfast.SignedDistance(held.object, cell=0.002)

poses = torch.tensor(clip.poses)
trans = torch.tensor(clip.trans)
betas = torch.tensor(clip.betas)
place = torch.tensor(clip.object.trans)
x, y, z = torch.tensor(clip.object.orient).T
o = torch.zeros_like(x)
cross = torch.stack([o, -z, y, z, o, -x, -y, x, o], 1).reshape(-1, 3, 3)
turn = torch.matrix_exp(cross)  # (T, 3, 3), world from object


def in_object(vertices: torch.Tensor) -> torch.Tensor:
    """Hand vertices (T, V, 3) in the mug's frame."""
    return (vertices - place[:, None]) @ turn


reference = holdfast.pair_distances(in_object(body(poses, trans, betas)[0])[0], mug)
FINGERS = 120  # the last 45 numbers of a pose are the right hand's

torch.manual_seed(1)
network = torch.nn.Sequential(
    torch.nn.Linear(FINGERS, 64), torch.nn.Tanh(), torch.nn.Linear(64, 45)
).double()
optimizer = torch.optim.Adam(network.parameters(), 3e-3)
for step in range(arguments.steps):
    fingers = network(poses[:, :FINGERS])
    hands = in_object(body(torch.cat([poses[:, :FINGERS], fingers], 1), trans, betas)[0])
    loss = (losses.distance_energy(hands, mug, reference) + 1e4 * losses.penetration_energy(hands, inside)).mean()
    optimizer.zero_grad()
    loss.backward()
    optimizer.step()
    if step % 20 == 0 or step == arguments.steps - 1:
        print(f"step {step}: loss {loss.item():.4f}")
