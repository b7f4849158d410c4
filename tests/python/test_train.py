# SPDX-License-Identifier: MIT
"""holdfast.train: losses and gradients of the C++ trainers it came from, files that the library reads,
trainings that go on, and what cannot be trained."""
import csv
import dataclasses
import json
import pickle
import shutil
import types
from pathlib import Path

import numpy as np
import pytest

import holdfast
from holdfast import _core

torch = pytest.importorskip("torch")

from holdfast.train import __main__ as program  # noqa: E402
from holdfast.train import imos, motion, networks, published, recognizer, run, wandr  # noqa: E402
from holdfast.train.imos_networks import Networks  # noqa: E402
from support import refused

FIXTURE = Path(__file__).parents[1] / "fixtures" / "train" / "cpp.npz"


@pytest.fixture(autouse=True)
def one_thread():
    torch.set_num_threads(1)


def train(*arguments):
    return program.main([str(argument) for argument in arguments])


# ---------------------------------------------------------------- the C++ trainers

@pytest.fixture(scope="module")
def cpp():
    """Losses and gradients of the trainers on LibTorch, on weights of a seed and batches that the file
    has: {case: {input: tensor, "loss": {name: value}, "gradient": {parameter: marks}}}."""
    with np.load(FIXTURE) as file:
        cases = json.loads(bytes(file["cpp"]))
        for name in file.files:
            if "/" in name:
                of, _, what = name.partition("/")
                cases.setdefault(of, {})[what] = torch.from_numpy(file[name])
    return cases


def marks(gradient):
    """Its norm, and its product with cos(0), cos(1), ..."""
    flat = gradient.double().flatten()
    return flat.norm().item(), (flat * torch.cos(torch.arange(len(flat), dtype=torch.float64))).sum().item()


def check(found, losses, gradients):
    """1e-5 of each loss; gradients are sums of many rounded numbers on both sides."""
    for name, value in found["loss"].items():
        if name in losses:
            assert losses[name] == pytest.approx(value, rel=1e-5, abs=1e-9), name
    wanted = found["gradient"]
    assert set(wanted) == set(gradients) and found["loss"]["total"] == pytest.approx(losses["total"], rel=1e-5)
    most = max(norm for norm, _ in wanted.values())
    for name, mark in wanted.items():
        off = max(abs(a - b) for a, b in zip(marks(gradients[name]), mark))
        assert off <= 2e-5 * mark[0] + 2e-7 * most, name


def unrolled(found, **options):
    """A wandr.Trainer's losses of the windows that the fixture has."""
    o = wandr.Options(width=16, blocks=2, latent=4, ankle_m=0.08, ball_m=0.02, **options)
    core, condition = _core, wandr.POSE + wandr.STATE + wandr.INTENTION[o.layout]
    of = networks.network_of
    norms = wandr.Norms({k: v for k, v in found.items() if k.startswith("statistics.")}, "cpu")
    self = types.SimpleNamespace(options=o, device="cpu", loop=wandr.Loop(norms, found["bones"].unsqueeze(0), o))
    self.decoder = of(core._random_residual(condition + 4, 4, 16, 2, wandr.STATE, 2))
    self.encoder = of(core._random_residual(condition + wandr.STATE, 0, 16, 1, 8, 3))
    self.critic = networks.Critic(of(core._random_residual(wandr.POSE + 2 * wandr.STATE, 0, 128, 2, 1, 1)), 2e-4)
    windows = wandr.Windows([wandr.Pose.of_states(x) for x in found["truth"]], *(
        found[k] for k in ("delta", "goal", "eta", "active")))
    return self, windows


def draws_of(monkeypatch, found):
    noise = iter(found["noise"])
    monkeypatch.setattr(torch, "randn", lambda *_, **__: next(noise))


def test_followed_windows_have_the_cpp_trainers_gradients(cpp, monkeypatch):
    found = cpp["follow"]
    self, windows = unrolled(found)
    draws_of(monkeypatch, found)
    losses = wandr.Trainer.unroll(self, windows, int(found["encoded"]), self.decoder, self.encoder, None)
    check(found, losses, {f"{part}.{name}": p.grad for part in ("decoder", "encoder")
                          for name, p in getattr(self, part).named_parameters()})


def test_free_motions_have_the_cpp_trainers_gradients(cpp, monkeypatch):
    found = cpp["free"]
    self, windows = unrolled(found)
    self.reference = networks.network_of(networks.under(found, "reference")).requires_grad_(False)
    self.true_moments = lambda count, draws: found["true_moments"]
    self.learn_critic = lambda true, own: wandr.Trainer.learn_critic(self, true, own)
    draws_of(monkeypatch, found)
    losses = wandr.Trainer.go_freely(self, windows, found["free_goal"], found["due"].long(), None, None)
    check(found, losses, {**{f"decoder.{name}": p.grad for name, p in self.decoder.named_parameters()},
                          **{f"critic.{name}": p.grad for name, p in self.critic.network.named_parameters()}})


TINY = dict(action_size="7", block_width="9", arms_condition="6", arms_first="19", arms_second="11", arms_decoder="17",
            arms_latent="4", body_condition="5", body_first="14", body_second="10", body_decoder="13", body_latent="6",
            attention_layers="2")


def tiny_config(**changes):
    return {**_core._imos_config(False), **TINY, **changes}


def sequences(cpp):
    found = cpp["sequences"]
    return imos.Sequences(**{k: v for k, v in found.items() if k != "action"}, action=found["action"].long())


def tiny_networks(cpp):
    nets = Networks(tiny_config(), present=True)
    with torch.no_grad():
        nets.load({k: torch.from_numpy(v) for k, v in _core._imos_start(tiny_config(), 3).items()}, "test")
    return nets


@pytest.mark.parametrize("name, iteration, first, steps", [("imos_whole", 55, 4, 11), ("imos_first", 0, 6, 3)])
def test_imos_has_the_cpp_trainers_gradients(cpp, name, iteration, first, steps):
    found, data, nets = cpp[name], sequences(cpp), tiny_networks(cpp)
    self = types.SimpleNamespace(options=imos.Options(iterations=100), nets=nets, progress=iteration / 100)
    self.critic = imos.ActionCritic(data, 1)
    loss, losses, shown = imos.Trainer.unroll(self, data, first, steps, imos.Draws(torch.Generator().manual_seed(4711)))
    parameters = dict(nets.named_parameters())
    loss.backward(inputs=list(parameters.values()))
    gradients = {name: p.grad for name, p in parameters.items() if p.grad is not None}
    assert bool(shown) == (name == "imos_whole")
    if shown:
        losses["critic"] = self.critic.learn_from(*shown, data.action, imos.Draws(torch.Generator().manual_seed(99)))
        gradients.update({f"critic.{k}": p.grad for k, p in self.critic.network.named_parameters()})
    check(found, losses, gradients)


def test_published_imos_has_the_cpp_trainers_gradients(cpp):
    data, nets, options = sequences(cpp), tiny_networks(cpp), imos.published()
    nets.train().dropout = options.dropout
    unroller = imos.Unroller(nets, data, 4, 0.01, imos.Draws(torch.Generator().manual_seed(4712)))
    for t in (4, 5):
        unroller.refresh()
        frame = unroller.predict(1.0 if t == 4 else 0.0, true_arms=True, true_object=True)
        arms, body, losses = unroller.judge(frame, options)
        gradients = {}
        for module, loss in (("arms", arms), ("body", body)):
            found = torch.autograd.grad(loss, list(nets.parameters()), allow_unused=True)
            gradients.update({f"{module}.{name}": g for (name, _), g in zip(nets.named_parameters(), found)
                              if g is not None})
        check(cpp[f"imos_paper_{t}"], losses, gradients)
        truth = unroller.truth(t)
        unroller.advance(imos.Frame(pose=frame.pose.detach(), transl=frame.transl.detach(), object=truth.object,
                                    body=truth.body, attended=None))


@pytest.mark.parametrize("name, options", [("recognizer", recognizer.Options()), ("recognizer_paper", recognizer.published())])
def test_recognizer_has_the_cpp_trainers_gradients(cpp, name, options):
    found, data = cpp[name], sequences(cpp)
    options = dataclasses.replace(options, stance=0.0, jitter=0.0)
    training = recognizer.Training(data.joints.flatten(2), data.action, (torch.zeros(0), torch.zeros(0)), options, "cpu")
    loss = training.loss(training.network(training.shown(torch.arange(len(data)), None)), data.action)
    loss.backward()
    check(found, {"total": loss.item()}, {k: p.grad for k, p in training.network.named_parameters()})
    folded = training.scale.folded(training.network.state_dict())
    logits = recognizer.Recognizer(folded)(data.joints.flatten(2))
    torch.testing.assert_close(logits, training.network(training.shown(torch.arange(len(data)), None)), rtol=1e-4, atol=1e-4)


# ---------------------------------------------------------------- the loop

def test_gradients_of_a_pose_are_cut_to_a_norm():
    states = torch.randn(3, 135, generator=torch.Generator().manual_seed(1))
    pose = wandr.Pose.of_states(states)
    phi, shift = torch.zeros(3, 22, 3, requires_grad=True), torch.zeros(3, 3, requires_grad=True)
    T, R = wandr.Cut.apply(pose.transl + shift, pose.rotations @ motion.exponential(phi), 2.0)
    weight = torch.tensor([1e-3, 10.0, float("nan")])
    ((T.sum(1) + R.sum((1, 2, 3))) * weight).sum().backward()
    norms = torch.sqrt((shift.grad**2).sum(1) + (phi.grad**2).sum((1, 2)))
    assert norms[0] < 2.0 and norms[1] == pytest.approx(2.0, rel=1e-3) and norms[2] == 0.0


@pytest.fixture(scope="module")
def corpus_folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("corpus")
    for name in ("demo_drink", "demo_inspect", "demo_pass"):
        holdfast.Clip.load(name).save(folder / f"{name}.npz")
    return folder


@pytest.fixture(scope="module")
def corpus(corpus_folder):
    return _core._read_corpus([str(corpus_folder)])


def bones_of():
    rest, _ = _core._body_measures()
    bones = rest[:22].copy()
    bones[1:] -= rest[list(motion.PARENTS[1:])]
    return torch.from_numpy(bones.astype(np.float32)).unsqueeze(0)


def corpus_of(data, options):
    return wandr.Corpus(data["clips"], bones_of(), wandr.Norms(data["statistics"], "cpu"), options, "cpu")


def small(**options):
    return wandr.Options(**{**dict(width=32, blocks=2, latent=8, iterations=40, frames=128, unroll=8, free_bodies=4,
                                   ankle_m=0.08, ball_m=0.02, deadline=(0.0, 1.0, 20.0, 20.0)), **options})


def trainer_of(data, options, **more):
    corpus = corpus_of(data, options)
    return wandr.Trainer(corpus, corpus, corpus.norms, bones_of(), options, torch.device("cpu"), **more)


def advance(trainer, count):
    for _ in range(count):
        found = trainer.step()
        trainer.iteration += 1
    return found


def test_joints_of_a_clip_are_the_body_models():
    clip = holdfast.Clip.load("demo_drink")[:5]
    states = torch.from_numpy(wandr_states(clip))
    pose = wandr.Pose.of_states(states)
    joints, _ = motion.forward_joints(pose.rotations, pose.transl, bones_of())
    expected = holdfast.BodyModel.load()(clip.poses, clip.trans)[1][:, :22]
    np.testing.assert_allclose(joints.numpy(), expected, atol=2e-6)
    wrist = motion.wrist_position(pose.rotations, pose.transl, bones_of(), motion.RIGHT_WRIST)
    np.testing.assert_allclose(wrist.numpy(), joints[:, motion.RIGHT_WRIST].numpy(), atol=1e-6)


def wandr_states(clip):
    """(F, 135): translation and the first two rows of each rotation."""
    turns = motion.exponential(torch.from_numpy(clip.poses.reshape(len(clip), 55, 3)[:, :22]).double())
    return np.concatenate((clip.trans, motion.six_of(turns).flatten(1).numpy()), 1).astype(np.float32)


def test_windows_lead_from_perturbed_starts_back_to_the_data(corpus):
    options = small(perturbed=1.0)
    data, (draws, _) = corpus_of(corpus, options), run.random_of(1, 0)
    clips, frames = data.draw_frames(8, 50, draws)
    assert (frames + 8 < data.length[clips]).all()
    windows = data.windows(clips, frames, 8, data.draw_goals(clips, frames, 8, draws), data.draw_perturbations(50, draws))
    off = [(pose.state() - data.poses(data.start[clips] + frames + a).state()).norm(dim=1)
           for a, pose in enumerate(windows.truth)]
    assert all((b < 0.95 * a).all() for a, b in zip(off, off[1:])) and (off[0] > 1e-4).all()
    # The corrective delta carries a body to the truth.
    loop = wandr.Loop(data.norms, data.bones, options)
    reached = loop.step(windows.truth[0], loop.target(windows.truth[0], windows.truth[1]))
    torch.testing.assert_close(reached.state(), windows.truth[1].state(), atol=2e-5, rtol=0)


def test_goals_are_the_clips_own_or_places_of_the_wrist():
    states = np.tile(wandr_states(holdfast.Clip.load("demo_drink")[:1]), (100, 1))
    states[:, 0] = np.arange(100)
    goals = np.array([[1.0, 0.0, 0.0], [2.0, 0.0, 0.0]])
    clip = (states, goals, np.array([20, 30]), True)
    data = wandr.Corpus([clip], bones_of(), None, small(no_goal=0.0, hindsight=0.0), "cpu")
    draws, _ = run.random_of(1, 0)
    goal, eta, active = data.draw_goals(np.array([0, 0, 0]), np.array([15, 25, 40]), 8, draws)
    assert active[:, 0].all() and active[:5, 1].all() and (goal[:5, 0, 0] == 1.0).all() and (goal[5:, 0, 0] == 2.0).all()
    np.testing.assert_array_equal(eta[:, 0, 0], [5, 4, 3, 2, 1, 10, 9, 8])
    np.testing.assert_array_equal(eta[:, 1, 0], [5, 4, 3, 2, 1, 1, 1, 1])
    assert not active[5:, 1].any()
    # Behind the last one the wrist's own place: x counts frames here.
    steps = goal[0, 2, 0] - goal[0, 2, 0] % 1 - 40
    assert active[:, 2].all() and 14 <= steps <= 60 and abs(eta[0, 2, 0] - steps) <= 1


def test_wandr_learns_what_it_is_shown(corpus):
    trainer = trainer_of(corpus, small(iterations=40, free_from=1.0, unroll=2, learning_rate=3e-3, perturbed=0.0))
    windows = trainer.corpus.draw(2, 64, run.random_of(5, 0)[0])
    loss = lambda: trainer.unroll(windows, 64, trainer.decoder, trainer.encoder, run.random_of(5, 0)[1], learn=False)["pose"]
    before = loss()
    advance(trainer, 40)
    assert loss() < 0.95 * before


def test_wandr_goes_on_exactly(corpus, tmp_path):
    through, first, second = (trainer_of(corpus, small()) for _ in range(3))
    # Beyond the point where free motions begin: their reference must survive too.
    advance(first, 24)
    assert first.reference is not None
    run.save_checkpoint(tmp_path / "checkpoint.safetensors", first, "options")
    run.load_checkpoint(tmp_path / "checkpoint.safetensors", second, "options")
    assert second.iteration == 24
    advance(second, 8)
    advance(through, 32)
    for name, values in through.weights().items():
        assert torch.equal(values, second.weights()[name]), name


def walking(frames, meters, due=()):
    """A clip that glides along y, with labeled goals at these frames."""
    states = np.tile(wandr_states(holdfast.Clip.load("demo_drink")[:1]), (frames, 1))
    states[:, 1] = np.linspace(0.0, meters, frames)
    return states, np.zeros((len(due), 3)), np.array(due, int), bool(len(due))


def published_of(corpus, clips, **changes):
    options, norms = published.Options(**changes), wandr.Norms(corpus["statistics"], "cpu")
    sequences = published.Sequences(clips, bones_of(), norms, options, "cpu")
    return published.Trainer(sequences, sequences, norms, bones_of(), options, "cpu")


def test_hindsight_goals_lie_a_walk_ahead(corpus):
    sequences = published_of(corpus, [walking(240, 4.0), walking(100, 1.0), walking(120, 1.0, [40, 90])]).sequences
    for seed in range(5):
        goal, eta, facing = sequences.goals(np.arange(3), run.random_of(seed, 0)[0])
        there = np.arange(240) + eta[0]
        ahead = sequences.pelvis[0, there, 1] - sequences.pelvis[0, :, 1]
        assert (ahead[eta[0] > 0] >= published.CUTOFF).all() and (eta[0][150:] == 0).all() and (eta[0][:140] > 0).all()
        np.testing.assert_array_equal(goal[0], sequences.wrists[0, there])
        np.testing.assert_array_equal(facing[0], sequences.facing[0, there])
        assert (eta[1] == 0).all()  # never 1.5 m away
        np.testing.assert_array_equal(eta[2, [0, 39, 40, 89, 90, 119]], [40, 1, 50, 1, 0, 0])


def test_published_sequences_are_filtered_cut_and_split():
    jump = walking(60, 1.0)
    jump[0][30:, 2] += 0.3
    clips = [walking(60, 1.0)] * 10 + [jump] * 5 + [walking(200, 1.0, [50, 60, 150])] * 5
    parts = published.select(clips, bones_of(), published.Options())
    assert [len(part) for part in parts] == [16, 2, 2]  # of 10 + 2 x 5: frame 60 is too close to 50
    reaches = sum(published.select(clips, bones_of(), published.Options(motion="reaching")), [])
    assert all(made for *_, made in reaches) and {int(due[0]) for _, _, due, _ in reaches} == {50, 90}
    with pytest.raises(holdfast.Error, match="10 are needed"):
        published.select(clips[:5], bones_of(), published.Options())


def test_published_wandr_trains_and_goes_on_exactly(corpus, tmp_path):
    clips = [walking(60, 2.0), walking(80, 1.0, [40])]
    through, first, second = (published_of(corpus, clips, epochs=12) for _ in range(3))
    assert sum(p.numel() for p in through.parameters) == 4153833
    kind, losses, _ = advance(through, 1)
    assert kind == "train" and np.isfinite(losses["total"]) and through.validate()["pose"] > 0.0
    for trainer in (first, second):
        trainer.iteration = 10 * trainer.batches  # the first epochs with rollouts
    advance(first, 1)
    run.save_checkpoint(tmp_path / "checkpoint.safetensors", first, "options")
    run.load_checkpoint(tmp_path / "checkpoint.safetensors", second, "options")
    advance(first, 1), advance(second, 1)
    for name, values in first.weights().items():
        assert torch.equal(values, second.weights()[name]), name


def test_masked_intentions_are_never_seen(corpus):
    trainer = published_of(corpus, [walking(240, 4.0)], intention="wrist")
    pose, deltas, goal, eta, facing, _ = trainer.sequences.batch(np.array([0]), run.random_of(1, 0)[0])
    now = wandr.Pose(pose.transl[0], pose.rotations[0])
    told = trainer.condition(now, deltas[0], goal[0], eta[0][:, None], facing[0])[:, -9:]
    assert (told[:, 3:] == 0.0).all() and (told[:100, :3] != 0.0).any() and (told[eta[0] == 0] == 0.0).all()


def test_weights_go_into_the_library_and_come_back(corpus, tmp_path):
    trainer = trainer_of(corpus, small())
    trainer.write(tmp_path / "w", {"note": "é", "made_by": "holdfast train wandr 0"})
    for name in ("w", "w_half"):
        assert 0.0 <= trainer.evaluate(tmp_path / name)["success"] <= 1.0
    texts, tensors = networks.read_safetensors(tmp_path / "w.safetensors")
    assert texts["intention"] == "bounded" and texts["note"] == "é"
    for name, values in trainer.weights().items():
        assert torch.equal(values, tensors[name])
    half = networks.read_safetensors(tmp_path / "w_half.safetensors")[1]
    assert torch.equal(half["decoder.output.weight"], tensors["decoder.output.weight"].half().float())
    again = trainer_of(corpus, small(), start=tensors)
    assert torch.equal(again.decoder.output.weight, trainer.mean_decoder.output.weight)


# ---------------------------------------------------------------- IMoS and the recognizer

ACTIONS = (("drink", "mug", "demo_drink"), ("pass", "apple", "demo_pass"), ("call", "phone", "demo_inspect"))


@pytest.fixture(scope="module")
def action_folder(tmp_path_factory):
    """Six clips of each of four people, an object that follows the right wrist in their hand."""
    folder = tmp_path_factory.mktemp("actions")
    model = holdfast.BodyModel.load()
    for subject in ("s1", "s2", "s3", "s10"):
        (folder / subject).mkdir()
        for k in range(6):
            action, object, name = ACTIONS[k % 3]
            whole = holdfast.Clip.load(name)[2 * k : 2 * k + 60]
            wrist = model(whole.poses, whole.trans)[1][:, 21]
            track = holdfast.ObjectTrack(wrist + [0.0, 0.0, -0.1], np.zeros((len(whole), 3)), object)
            clip = holdfast.Clip(whole.poses, whole.trans, betas=whole.betas, object=track,
                                 holding_hand=np.ones(len(whole), np.uint8))
            clip.action, clip.subject, clip.body_model = action, subject, whole.body_model
            clip.save(folder / subject / f"{object}_{action}_{k}.npz")
    return folder


@pytest.fixture(scope="module")
def sets(action_folder):
    return _core._read_action_set([str(action_folder)], mirror=True)


def imos_trainer(sets, config=None, **options):
    return imos.Trainer(sets, config or tiny_config(), imos.Options(**{**dict(iterations=20, batch=8), **options}),
                        torch.device("cpu"))


def test_action_sets_are_split_and_mirrored(sets):
    assert [len(sets[name]["action"]) for name in ("train", "validation", "test")] == [24, 6, 6]
    assert sets["train"]["mirrored"] == [False] * 12 + [True] * 12
    joints = sets["train"]["joints"]
    np.testing.assert_allclose(joints[12, ..., 0], -joints[0][:, list(_mirror())][..., 0], atol=1e-5)


def _mirror():
    return (0, 2, 1, 3, 5, 4, 6, 8, 7, 9, 11, 10, 12, 14, 13, 15, 17, 16, 19, 18, 21, 20)


def test_disturbed_stances_are_of_another_person_doing_the_same(sets):
    before = imos.Sequences.of_arrays(sets["train"])
    after = imos.Sequences(**vars(before))
    imos.disturb_stances(after, 0.1, imos.Draws(torch.Generator().manual_seed(1)))
    rotations = lambda s: motion.rotations_of(s.pose.unflatten(2, (22, 6)))
    turns = rotations(before).transpose(3, 4) @ rotations(after)
    assert torch.allclose(turns[:, 10:, 16:], torch.eye(3).expand_as(turns[:, 10:, 16:]), atol=1e-5)
    assert torch.allclose(turns[:, :, 1:16], turns[:, :1, 1:16].expand_as(turns[:, :, 1:16]), atol=1e-5)
    assert (turns[:, 0] - torch.eye(3)).abs().amax() > 0.05
    held = after.by_right[:, 1:] > 0
    distance = lambda s: (s.object_T - s.joints[:, :, 21]).norm(dim=-1)[:, 1:][held]
    assert held.any() and torch.allclose(distance(after), distance(before), atol=1e-4)
    same = imos.Sequences(**vars(before))
    imos.disturb_stances(same, 0.0, None)
    assert same.pose is before.pose


def test_imos_begins_by_standing_still(sets):
    for config in (tiny_config(), tiny_config(modules="one")):
        errors = imos_trainer(sets, config).errors(imos.Sequences.of_arrays(sets["validation"]))
        assert errors["mpjpe_m"] == pytest.approx(errors["still_m"], abs=0.03)


def test_imos_goes_on_exactly(sets, tmp_path):
    through, first, second = (imos_trainer(sets) for _ in range(3))
    advance(first, 12)  # the critic has begun
    run.save_checkpoint(tmp_path / "c", first, "options")
    run.load_checkpoint(tmp_path / "c", second, "options")
    advance(second, 4)
    _, losses, _ = advance(through, 16)
    assert losses["doubt"] > 0.0
    for name, values in through.nets.tensors().items():
        assert torch.equal(values, second.nets.tensors()[name]), name


def test_imos_learns_a_handful_of_sequences(sets):
    trainer = imos_trainer(sets, iterations=20, learning_rate=1e-3, critic=0.0)
    loss = lambda: trainer.unroll(trainer.data, 4, 4, imos.Draws(torch.Generator().manual_seed(1)))[1]["total"]
    before = loss()
    advance(trainer, 20)
    assert loss() < 0.7 * before


def test_published_imos_lowers_its_rate_and_keeps_fixed_embeddings(sets):
    options = imos.published()
    options.iterations, options.batch = 6, 8
    trainer = imos.Trainer(sets, tiny_config(action_embedding="random"), options, torch.device("cpu"))
    before = trainer.nets.tensors()["action_embedding.weight"].clone()
    _, losses, more = advance(trainer, 4)
    assert np.isfinite(losses["total"]) and more["learning_rate"] == options.learning_rate
    assert torch.equal(before, trainer.nets.tensors()["action_embedding.weight"])
    plateau = imos.Plateau(1.0)
    for loss in (1.0, 1.0, 1.0, 1.0):
        plateau.observe(loss)
    assert plateau.rate == 1.0
    plateau.observe(1.0)
    assert plateau.rate == 0.999 and plateau.bad_epochs == 0


def test_the_critic_tells_motions_and_their_actions(sets):
    data, draw = imos.Sequences.of_arrays(sets["train"]), imos.Draws(torch.Generator().manual_seed(3))
    critic = imos.ActionCritic(data, 1)
    true = critic.motions(critic.true_frames(data), 0.0, draw)
    assert true.shape == (24, 1725) and 0.3 < true.std() < 1.1 and true.mean().abs() < 0.01
    own = true + 0.5 * draw.normal(true.shape)
    for _ in range(30):
        share = critic.learn_from(true, own, data.action, draw)
    assert share > 0.9
    wrong = data.action.roll(1)
    doubt = lambda motions, actions: networks.doubt_of(critic.scores(motions, actions)).item()
    assert doubt(true, data.action) < 0.5 * min(doubt(own, data.action), doubt(true, wrong))


def test_the_recognizer_learns_sequences_by_heart(sets):
    motions, labels = recognizer.motions_of(sets["train"])
    options = recognizer.Options(epochs=60, batch=8)
    validation = recognizer.motions_of(sets["validation"])
    weights, best, lines = recognizer.Training(motions, labels, validation, options, "cpu").run()
    assert best["validation_accuracy"] == max(line["validation_accuracy"] for line in lines)
    accuracy, mistaken = recognizer.accuracy_of(recognizer.Recognizer(weights), sets["train"], _core._vocabulary()[0])
    assert accuracy > 0.9 and sum(mistaken.values()) == round((1.0 - accuracy) * len(labels))
    short = dataclasses.replace(options, epochs=3)
    _, _, some = recognizer.Training(motions, labels, validation, short, "cpu").run(lambda line: line["iteration"] < 2)
    assert len(some) == 2
    again = [recognizer.Training(motions, labels, validation, short, "cpu").run()[0] for _ in range(2)]
    assert all(torch.equal(a, b) for a, b in zip(again[0].values(), again[1].values()))


# ---------------------------------------------------------------- the command line

WANDR = ("--width", 16, "--blocks", 1, "--frames", 64, "--unroll", 4, "--free-share", 1, "--evaluate-every", 8, "--device", "cpu")


def test_wandr_writes_weights_log_and_curves_and_resumes(corpus_folder, tmp_path, capsys):
    out = tmp_path / "out"
    arguments = ("wandr", corpus_folder, "-o", out, "--iterations", 8, *WANDR)
    assert train(*arguments) == 0
    assert "8 iterations" in capsys.readouterr().out
    rows = list(csv.DictReader(open(out / "training_log.csv")))
    assert [(row["kind"], row["iteration"]) for row in rows if row["kind"] == "reach"] == [("reach", "8")]
    assert {"free", "train"} == {row["kind"] for row in rows} - {"reach"}
    texts, _ = networks.read_safetensors(out / "best_half.safetensors")
    assert texts["format"] == "wandr-1" and "h captured" in texts["corpus"] and texts["rest_pelvis"]
    assert json.loads(texts["validation"])["success"] >= 0.0
    assert holdfast.reach([0.3, -1.0, 1.0], samples=1, weights=str(out / "best.safetensors")).clip is not None
    try:
        import matplotlib  # noqa: F401
        assert (out / "training_curves.png").read_bytes()[:4] == b"\x89PNG"
    except ModuleNotFoundError:
        pass
    weights = (out / "latest.safetensors").read_bytes()
    assert train(*arguments) == 0
    assert "resuming after iteration 8" in capsys.readouterr().err
    assert train(*arguments, "--kl", 0.25) == 1
    assert "different options or data" in capsys.readouterr().err
    assert (out / "latest.safetensors").read_bytes() == weights
    assert train("wandr", corpus_folder, "-o", tmp_path / "again", "--iterations", 1, "--from", out / "best.safetensors",
                 "--device", "cpu", "--frames", 64, "-q") == 0


def test_published_wandr_logs_rollouts_that_begin_late(corpus_folder, tmp_path, monkeypatch):
    assert run.means([{"total": 1.0}, {"total": 3.0, "rollout": 4.0}]) == {"total": 2.0, "rollout": 4.0}
    clips = tmp_path / "clips"
    clips.mkdir()
    for k in range(4):
        for clip in corpus_folder.glob("*.npz"):
            shutil.copy(clip, clips / f"{clip.stem}_{k}.npz")
    monkeypatch.setattr(published, "EPOCHS_A_FRAME", 1)  # rollouts of 2 frames from the third epoch on
    out = tmp_path / "out"
    assert train("wandr", clips, "-o", out, "--paper", "--epochs", 6, "--device", "cpu", "-q") == 0
    rows = list(csv.DictReader(open(out / "training_log.csv")))
    assert float(next(row for row in rows if row["kind"] == "train")["rollout"]) > 0.0


def test_imos_and_recognizer_write_what_the_library_reads(action_folder, tmp_path, capsys):
    out = tmp_path / "out"
    common = (action_folder, "--device", "cpu")
    assert train("imos", *common, "-o", out, "--iterations", 4, "--batch", 8, "--evaluate-every", 2, "--mirror") == 0
    texts, tensors = networks.read_safetensors(out / "best_half.safetensors")
    assert texts["format"] == "imos-1" and texts["key_frames"] == "whole" and not any(map(imos.is_present_encoder, tensors))
    assert json.loads(texts["seen"]) == {"call": {"phone": 4}, "drink": {"mug": 4}, "pass": {"apple": 4}}
    made = holdfast.synthesize("drink", "mug", samples=1, weights=str(out / "best_half.safetensors"), key_frames=5)
    assert len(made.clip) > 0
    for name, flags, config in (("plain", ["--no-attention"], {"self_attention": "no"}),
                                ("one", ["--one-module", "--random-embeddings"],
                                 {"modules": "one", "action_embedding": "random"})):
        assert train("imos", *common, "-o", tmp_path / name, "--iterations", 1, "--batch", 8, "-q", *flags) == 0
        assert config.items() <= networks.read_safetensors(tmp_path / name / "best.safetensors")[0].items()
    # The published recipe counts epochs.
    assert train("imos", *common, "-o", tmp_path / "published", "--paper", "--epochs", 2, "--batch", 4, "-q") == 0
    log = (tmp_path / "published" / "training_log.csv").read_text()
    sequences = int(networks.read_safetensors(tmp_path / "published" / "best.safetensors")[0]["data"].split()[0])
    assert imos.batches_of(2, sequences, 4) == 2 * (sequences // 4) and imos.batches_of(1600, 789, 64) == 1600 * 12
    assert str(2 * (sequences // 4)) in log.splitlines()[-1].split(",")
    assert train("imos", *common, "-o", out, "--iterations", 4, "--batch", 8, "--mirror", "--stance-noise", 0.2) == 1
    assert "different options or data" in capsys.readouterr().err
    file = tmp_path / "r.safetensors"
    assert train("recognizer", *common, "-o", file, "--paper", "--epochs", 2) == 0
    said = capsys.readouterr().out
    assert "epoch 2 of 2" not in said or "validation" in said
    texts, _ = networks.read_safetensors(file)
    assert texts["format"] == "imos-recognizer-1" and texts["held_out"] == "s10" and "accuracy, held out" in texts
    assert train("recognizer", *common, "-o", file) == 1
    assert "exists already" in capsys.readouterr().err


class Attack:
    def __reduce__(self):
        return (Path.touch, (Path("executed"),))


def test_checkpoints_of_others_are_refused_and_none_is_executed(corpus, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    trainer = trainer_of(corpus, small())
    path = tmp_path / "checkpoint.safetensors"
    run.save_checkpoint(path, trainer, "options")
    refused(holdfast.Error, "different options", run.load_checkpoint, path, trainer, "others")
    trainer.write(tmp_path / "weights", {})
    with pytest.raises(holdfast.Error, match="not a checkpoint"):
        run.load_checkpoint(tmp_path / "weights.safetensors", trainer, "options")
    whole = path.read_bytes()
    for damaged in (b"", whole[:1000], whole[:-10], pickle.dumps(Attack()), (2**60).to_bytes(8, "little") + whole[8:]):
        path.write_bytes(damaged)
        refused(holdfast.Error, "checkpoint.safetensors", run.load_checkpoint, path, trainer, "options")
    assert not (tmp_path / "executed").exists()
    refused(holdfast.Error, "missing", networks.read_safetensors, tmp_path / "missing")


def test_bad_input_is_named(corpus_folder, action_folder, tmp_path, capsys):
    def fails(code, message, *arguments):
        try:
            assert train(*arguments, "-o", tmp_path / "out") == code
        except SystemExit as left:
            assert left.code == code
        assert message in capsys.readouterr().err, arguments

    (tmp_path / "empty").mkdir()
    fails(1, "nowhere", "wandr", "nowhere")
    fails(1, "none of 0 file(s)", "wandr", tmp_path / "empty")
    fails(1, "contains no clip for validation", "wandr", corpus_folder, "--held-out", tmp_path / "empty")
    (tmp_path / "empty" / "broken.npz").write_bytes(b"PK\x03\x04 not a zip")
    fails(1, "broken.npz", "wandr", tmp_path / "empty")
    fails(2, "--unroll", "wandr", corpus_folder, "--unroll", 5)
    fails(2, "--iterations", "wandr", corpus_folder, "--iterations", 0)
    fails(2, "--paper excludes --width", "wandr", corpus_folder, "--paper", "--width", 64)
    fails(2, "--epochs needs --paper", "wandr", corpus_folder, "--epochs", 4)
    fails(1, "demo_drink.npz", "wandr", corpus_folder, "--from", corpus_folder / "demo_drink.npz")
    fails(1, "--device nothing", "wandr", corpus_folder, "--device", "nothing")
    fails(1, "no object", "imos", corpus_folder)
    fails(1, "held out or for validation", "imos", action_folder, "--held-out", "s1,s2,s3,s10")
    fails(2, "--batch", "imos", action_folder, "--batch", 1)
    fails(2, "--paper excludes --critic", "imos", action_folder, "--paper", "--critic", 0.1)
    fails(1, "words.npz", "imos", action_folder, "--action-vectors", tmp_path / "words.npz")
    fails(2, "no network 'dance'", "dance", corpus_folder)
