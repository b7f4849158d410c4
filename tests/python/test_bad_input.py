# SPDX-License-Identifier: MIT
"""Every argument that takes an array, a mesh or a clip, against what arrays can be: the right result,
or an exception of the documented types whose text names the argument and what was expected."""
import ast
import tempfile
from collections import namedtuple
from pathlib import Path

import numpy as np
import pytest

import holdfast
from box_hand import write_box_hand

HUGE = 10**11  # rows of a view that repeats one: a copy takes more than any memory has
CUBE = (
    np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float) * 0.0625,
    np.array([[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
              [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]]),
)
POSES, TRANS, BETAS = np.full((4, 165), 0.125), np.full((4, 3), 0.25), np.full(3, 0.5)
POSE, POINT, EYE = POSES[0], TRANS[0], np.eye(3)
IDS = np.arange(3, 60, 7)
POINTS = (np.arange(21.0) - 10.0).reshape(7, 3) / 128.0
PAIRS = np.full((7, 7), 0.125)
BALLS = np.full((2, 4), 0.0625)
MODEL = holdfast.BodyModel.load()
HAND = (np.arange(63.0).reshape(1, 21, 3) % 7) / 64  # no hand, but of its size
NEAR = holdfast.SignedDistance(CUBE)


def demo():
    return holdfast.Clip(POSES, TRANS)


def holding():
    return demo().with_object(holdfast.ObjectTrack(TRANS, TRANS))


def track(trans=TRANS, orient=TRANS, **options):
    made = holdfast.ObjectTrack(trans, orient, **options)
    return made.trans, made.orient, *(made.surface or ())


def clip(**arrays):
    made = holdfast.Clip(**{"poses": POSES, "trans": TRANS, **arrays})
    return made.poses, made.trans, made.betas, made.holding_hand


def assigned(name, value):
    made = demo()
    setattr(made, name, value)
    return getattr(made, name)


def vjp(**arrays):
    usual = dict(poses=POSES, trans=TRANS, betas=BETAS, vertex_ids=IDS,
                 grad_vertices=np.full((4, len(IDS), 3), 0.5), grad_joints=np.full((4, 55, 3), 0.5))
    return MODEL.vjp(**{**usual, **arrays}, with_betas=True)


def body(poses=POSES, trans=TRANS, betas=BETAS, vertex_ids=IDS):
    return MODEL(poses, trans, betas, vertex_ids)


def robot():
    if not hasattr(robot, "path"):
        robot.path = write_box_hand(Path(tempfile.mkdtemp()) / "boxes.urdf")
    return robot.path


def fitter():
    if not hasattr(fitter, "made"):
        fitter.made = holdfast.FrameFitter("apple", object_vertices=50)
    return fitter.made


def start(poses=POSE, trans=POINT, object_rotation=EYE, object_translation=POINT):
    return fitter().start(poses, trans, object_rotation, object_translation)


def step(poses=POSE, trans=POINT):
    start()
    return fitter().step(poses, trans)


def motions(**given):
    arrays = {"states": np.zeros((2, 135)), "previous_deltas": np.zeros((2, 135)), "goals": np.ones((2, 3)),
              "deadlines": np.array([60, 60]), "streams": np.array([0, 1])} | given
    return holdfast.reach_motions("intention", **arrays, frames=4)


def factors(value):  # one number is a factor: as arrays of one, it is wrong
    number = np.isscalar(value) or isinstance(value, np.ndarray) and value.ndim == 0
    return np.full(1, value) if number else value


Array = namedtuple("Array", "call good none dear gaps", defaults=(False, False, False))
Mesh = namedtuple("Mesh", "call none dear", defaults=(False, False))
Person = namedtuple("Person", "call none", defaults=(False,))
# By the stub's function and argument. `none`: None is as good as anything. `dear`: what is right takes
# long, so that only what is wrong is tried. `gaps`: NaN is what was not seen.
ROWS = {
    "ObjectTrack.trans": Array(lambda v: track(v), TRANS),
    "ObjectTrack.orient": Array(lambda v: track(orient=v), TRANS),
    "ObjectTrack.surface": Mesh(lambda v: track(surface=v), none=True),
    "Clip.poses": Array(lambda v: clip(poses=v), POSES),
    "Clip.trans": Array(lambda v: clip(trans=v), TRANS),
    "Clip.betas": Array(lambda v: clip(betas=v), BETAS, none=True),
    "Clip.holding_hand": Array(lambda v: clip(holding_hand=v), np.array([0, 1, 2, 3]), none=True),
    "Clip.from_smplx.holding_hand": Array(
        lambda v: holdfast.Clip.from_smplx({"global_orient": np.zeros((4, 3))}, holding_hand=v).holding_hand,
        np.array([0, 1, 2, 3]), none=True),
    "Clip.load.betas": Array(lambda v: holdfast.Clip.load("demo_drink", betas=v).poses, BETAS, none=True),
    "import_motion.betas": Array(lambda v: holdfast.import_motion("demo_drink", betas=v).poses, BETAS, none=True),
    "Clip.betas.value": Array(lambda v: assigned("betas", v), BETAS),
    "Clip.holding_hand.value": Array(
        lambda v: assigned("holding_hand", v), np.array([0, 1, 2, 3]), none=True),
    "BodyModel.__call__.poses": Array(lambda v: body(v), POSES),
    "BodyModel.__call__.trans": Array(lambda v: body(trans=v), TRANS, none=True),
    "BodyModel.__call__.betas": Array(lambda v: body(betas=v), BETAS, none=True),
    "BodyModel.__call__.vertex_ids": Array(lambda v: body(vertex_ids=v), IDS, none=True),
    "BodyModel.vjp.poses": Array(lambda v: vjp(poses=v), POSES),
    "BodyModel.vjp.trans": Array(lambda v: vjp(trans=v), TRANS, none=True),
    "BodyModel.vjp.betas": Array(lambda v: vjp(betas=v), BETAS, none=True),
    "BodyModel.vjp.vertex_ids": Array(
        lambda v: vjp(vertex_ids=v, grad_vertices=None), IDS, none=True),
    "BodyModel.vjp.grad_vertices": Array(
        lambda v: vjp(grad_vertices=v), np.full((4, len(IDS), 3), 0.5), none=True),
    "BodyModel.vjp.grad_joints": Array(
        lambda v: vjp(grad_joints=v), np.full((4, 55, 3), 0.5), none=True),
    "SignedDistance.mesh": Mesh(lambda v: holdfast.SignedDistance(v)(POINTS)),
    "SignedDistance.faces": Array(lambda v: holdfast.SignedDistance(CUBE[0], v)(POINTS), CUBE[1]),
    "SignedDistance.__call__.points": Array(NEAR, POINTS),
    "SignedDistance.gradient.points": Array(NEAR.gradient, POINTS),
    "load_mesh.path_or_name": Mesh(holdfast.load_mesh),
    "decimate.mesh": Mesh(lambda v: holdfast.decimate(v, 8)),
    "check_mesh.mesh": Mesh(holdfast.check_mesh),
    "doctor.clip_or_mesh": Mesh(holdfast.doctor),
    "intersection_volume.mesh_a": Mesh(lambda v: holdfast.intersection_volume(v, CUBE)),
    "intersection_volume.mesh_b": Mesh(lambda v: holdfast.intersection_volume(CUBE, v)),
    "pair_distances.hand": Array(lambda v: holdfast.pair_distances(v, POINTS), POINTS),
    "pair_distances.object": Array(lambda v: holdfast.pair_distances(POINTS, v), POINTS),
    "distance_energy.hand": Array(lambda v: holdfast.distance_energy(v, POINTS, PAIRS), POINTS),
    "distance_energy.object": Array(lambda v: holdfast.distance_energy(POINTS, v, PAIRS), POINTS),
    "distance_energy.reference": Array(
        lambda v: holdfast.distance_energy(POINTS, POINTS, v), PAIRS),
    "contact_energy.hand": Array(lambda v: holdfast.contact_energy(v, POINTS, PAIRS, 1), POINTS),
    "contact_energy.object": Array(lambda v: holdfast.contact_energy(POINTS, v, PAIRS, 1), POINTS),
    "contact_energy.reference": Array(
        lambda v: holdfast.contact_energy(POINTS, POINTS, v, 1), PAIRS),
    "penetration_energy.points": Array(lambda v: holdfast.penetration_energy(v, NEAR), POINTS),
    "FrameFitter.object": Mesh(lambda v: holdfast.FrameFitter(v, object_vertices=8).object),
    "FrameFitter.betas": Array(
        lambda v: holdfast.FrameFitter(CUBE, betas=v).object, BETAS, none=True, dear=True),
    "FrameFitter.start.poses": Array(lambda v: start(v), POSE),
    "FrameFitter.start.trans": Array(lambda v: start(trans=v), POINT),
    "FrameFitter.start.object_rotation": Array(lambda v: start(object_rotation=v), EYE),
    "FrameFitter.start.object_translation": Array(lambda v: start(object_translation=v), POINT),
    "FrameFitter.step.poses": Array(lambda v: step(v), POSE),
    "FrameFitter.step.trans": Array(lambda v: step(trans=v), POINT),
    "fit.clip": Person(lambda v: holdfast.fit(v, "apple")),
    "fit.object": Mesh(lambda v: holdfast.fit(demo(), v), dear=True),
    "fit.at": Array(lambda v: holdfast.fit(demo(), "apple", at=v), POINT, none=True, dear=True),
    "fit.region": Mesh(lambda v: holdfast.fit(demo(), "apple", region=v), none=True, dear=True),
    "fit.avoid": Mesh(lambda v: holdfast.fit(demo(), "apple", avoid=v), none=True, dear=True),
    "fit.avoid_balls": Array(lambda v: holdfast.fit(demo(), "apple", avoid_balls=v), BALLS, none=True,
                             dear=True),
    "fit.switch_frames": Array(
        lambda v: holdfast.fit(demo(), "apple", hand_over=True, switch_frames=v), np.array([1, 2]),
        none=True, dear=True),
    "offhand.clip": Person(lambda v: holdfast.offhand(v, "apple")),
    "offhand.object": Mesh(lambda v: holdfast.offhand(demo(), v), dear=True),
    "refine.clip": Person(lambda v: holdfast.refine(v, "apple")),
    "refine.object": Mesh(lambda v: holdfast.refine(holding(), v), dear=True),
    "transfer_to_robot.clip": Person(lambda v: holdfast.transfer_to_robot(v, robot())),
    "transfer_to_robot.object": Mesh(
        lambda v: holdfast.transfer_to_robot(holding(), robot(), object=v), dear=True),
    "transfer.clip": Person(lambda v: holdfast.transfer(v, scale=1.1)),
    "transfer.object": Mesh(
        lambda v: holdfast.transfer(holding(), v, from_object=CUBE), none=True, dear=True),
    "transfer.from_object": Mesh(
        lambda v: holdfast.transfer(holding(), from_object=v), none=True, dear=True),
    "transfer.scale": Array(
        lambda v: holdfast.transfer(holding(), scale=factors(v), from_object=CUBE),
        POINT, none=True, dear=True),
    "transfer.map": Array(
        lambda v: holdfast.transfer(holding(), CUBE, map=(v, CUBE[0]), from_object=CUBE),
        CUBE[0], dear=True),
    "transfer.betas": Array(
        lambda v: holdfast.transfer(holding(), betas=v, from_object=CUBE),
        BETAS, none=True, dear=True),
    "solve_markers.object": Mesh(
        lambda v: holdfast.solve_markers(
            {"names": ["a", "b", "c"], "positions": np.eye(3)[None], "rate_hz": 50.0}, object=v,
            object_markers={"a": (1, 0, 0), "b": (0, 1, 0), "c": (0, 0, 1)}),
        none=True, dear=True),
    "solve_keypoints.keypoints": Array(
        lambda v: holdfast.solve_keypoints(v, hand="right", meters_per_unit=1.0)[0].poses, HAND, gaps=True),
    "grasp.object": Mesh(holdfast.grasp, dear=True),
    "grasp.at": Array(lambda v: holdfast.grasp("apple", at=v), POINT, none=True, dear=True),
    "grasp.region": Mesh(lambda v: holdfast.grasp("apple", region=v), none=True, dear=True),
    "grasp.avoid": Mesh(lambda v: holdfast.grasp("apple", avoid=v), none=True, dear=True),
    "grasp.avoid_balls": Array(lambda v: holdfast.grasp("apple", avoid_balls=v), BALLS, none=True,
                               dear=True),
    "grasp.clip": Person(lambda v: holdfast.grasp("apple", hand="both", clip=v), none=True),
    "grasps.object": Mesh(lambda v: holdfast.grasps(v, 2), dear=True),
    "grasps.at": Array(lambda v: holdfast.grasps("apple", 2, at=v), POINT, none=True, dear=True),
    "grasps.region": Mesh(lambda v: holdfast.grasps("apple", 2, region=v), none=True, dear=True),
    "grasps.avoid": Mesh(lambda v: holdfast.grasps("apple", 2, avoid=v), none=True, dear=True),
    "grasps.avoid_balls": Array(lambda v: holdfast.grasps("apple", 2, avoid_balls=v), BALLS, none=True,
                                dear=True),
    "reach.goals": Array(holdfast.reach, np.array([[1.0, 0.5, 1.0]]), dear=True),
    "reach.clip": Person(lambda v: holdfast.reach([1, 0.5, 1], clip=v), none=True),
    "reach.object": Mesh(lambda v: holdfast.reach([1, 0.5, 1], object=v), none=True, dear=True),
    "reach.approach": Array(
        lambda v: holdfast.reach([1, 0.5, 1], approach=v), POINT, none=True, dear=True),
    "reach.obstacles": Mesh(
        lambda v: holdfast.reach([1, 0.5, 1], obstacles=[v], method="latent-opt"), dear=True),
    "reach_starts.clips": Person(lambda v: holdfast.reach_starts([v])),
    "reach_motions.states": Array(lambda v: motions(states=v), np.zeros((2, 135)), dear=True),
    "reach_motions.previous_deltas": Array(
        lambda v: motions(previous_deltas=v), np.zeros((2, 135)), dear=True),
    "reach_motions.goals": Array(lambda v: motions(goals=v), np.ones((2, 3)), dear=True),
    "reach_motions.deadlines": Array(lambda v: motions(deadlines=v), np.array([60, 60]), dear=True),
    "reach_motions.streams": Array(lambda v: motions(streams=v), np.array([0, 1]), dear=True),
    "walk.clip": Person(holdfast.walk),
    "joint_positions.clip": Person(holdfast.joint_positions),
    "find_holds.clip": Person(lambda v: holdfast.find_holds(v, CUBE)),
    "find_holds.object": Mesh(lambda v: holdfast.find_holds(demo(), v), none=True, dear=True),
    "find_handovers.clip": Person(lambda v: holdfast.find_handovers(v, 0.1)),
    "handover_clip.object": Mesh(holdfast.handover_clip, dear=True),
    "GoalFollower.clip": Person(lambda v: holdfast.GoalFollower(clip=v), none=True),
    "GoalFollower.step.goal": Array(lambda v: holdfast.GoalFollower().step(v), np.array([0.5, -0.5, 1.0])),
    "GoalFollower.push.by": Array(lambda v: holdfast.GoalFollower().push(v), POINT),
    "synthesize.object": Mesh(lambda v: holdfast.synthesize("drink", v), dear=True),
    "synthesize.clip": Person(lambda v: holdfast.synthesize("drink", "mug", clip=v), none=True),
    "synthesize.betas": Array(
        lambda v: holdfast.synthesize("drink", "mug", betas=v), BETAS, none=True, dear=True),
    "score.clip": Person(lambda v: holdfast.score(v, CUBE)),
    "score.object": Mesh(lambda v: holdfast.score(demo(), v), none=True, dear=True),
    "hold_trial.clip": Person(lambda v: holdfast.hold_trial(v, CUBE)),
    "hold_trial.object": Mesh(lambda v: holdfast.hold_trial(demo(), v), none=True, dear=True),
    "score.reference": Person(lambda v: holdfast.score(demo(), reference=v), none=True),
    "render.clip": Person(lambda v: holdfast.render(v, "none.png")),
    "render.object": Mesh(
        lambda v: holdfast.render(demo(), "none.png", object=v), none=True, dear=True),
    "report.clips": Person(lambda v: holdfast.report([v], "none.html")),
    "report.object": Mesh(
        lambda v: holdfast.report(demo(), "none.html", object=v), none=True, dear=True),
    "export.clip": Person(lambda v: holdfast.export(v, "none.bvh")),
    "export.object": Mesh(
        lambda v: holdfast.export(demo(), "none.glb", object=v), none=True, dear=True),
    "convert.clip": Person(lambda v: holdfast.convert(v, to_body=MODEL)),
    "convert.onto": Person(lambda v: holdfast.convert(demo(), to_body=MODEL, onto=v), none=True),
}


def taken_by_stub():
    """'function.argument' of everything in the stub that takes an array, a mesh or a clip."""
    names = set()

    def look(function, where):
        arguments = function.args
        for argument in arguments.posonlyargs + arguments.args + arguments.kwonlyargs:
            text = ast.unparse(argument.annotation) if argument.annotation else ""
            if any(word in text for word in ("ArrayLike", "_Object", "_Clip", "_Shown")):
                names.add(f"{where}.{argument.arg}")

    tree = ast.parse((Path(holdfast.__file__).parent / "_core.pyi").read_text())
    for node in tree.body:
        if isinstance(node, ast.FunctionDef):
            look(node, node.name)
        for member in node.body if isinstance(node, ast.ClassDef) else []:
            if isinstance(member, ast.FunctionDef):
                own = member.name == "__init__"
                look(member, node.name if own else f"{node.name}.{member.name}")
    return names


def test_every_argument_has_a_row():
    assert taken_by_stub() == set(ROWS)


def wrong(good, none, gaps=False):
    """What no array argument takes, by what it is."""
    kinds = {
        "another axis": good[None, None, None],
        "a number": 3.0,
        "numpy's number": np.float64(1.0),
        "no dimension": np.array(1.0),
        "complex": good.astype(complex),
        "objects": good.astype(object),
        "texts": np.full(good.shape, "x"),
        "bytes": np.full(good.shape, b"x"),
        "times": np.zeros(good.shape, "datetime64[s]"),
        "fields": np.zeros(good.shape, [("a", float)]),
        "ragged": [[1.0, 2.0], [3.0]],
        "a dict": {"a": 1},
        "a generator": (number for number in good.ravel().tolist()),
        "a function": len,
        "too large": np.broadcast_to(good[:1], (HUGE, *good.shape[1:])),
    }
    if not none:
        kinds["None"] = None
    if good.dtype.kind == "f":
        for name, number in {"NaN": np.nan, "infinite": np.inf, "-infinite": -np.inf}.items():
            if gaps and name == "NaN":
                continue
            kinds[name] = good.copy()
            kinds[name].flat[-1] = number
    else:
        kinds["not whole"] = good * 1.0
        kinds["out of range"] = good + 2**40
        kinds["unsigned"] = np.full(good.shape, 2**64 - 1, np.uint64)
    if good.ndim > 1:
        kinds["narrow"] = good[..., :-1]
    return kinds


def same(good):
    """The same numbers in all ways that numpy can have them."""
    kinds = {
        "with gaps": np.repeat(good, 2, axis=-1)[..., ::2],
        "Fortran's order": np.asfortranarray(good),
        "backwards": good[::-1].copy()[::-1],
        "backwards along the last": good[..., ::-1].copy()[..., ::-1],
        "a list": good.tolist(),
        "other bytes": good.astype(good.dtype.newbyteorder()),
        "short": good.astype("f4" if good.dtype.kind == "f" else "i2"),
        "long": good.astype("longdouble" if good.dtype.kind == "f" else "u8"),
        "a subclass": good.view(np.recarray),
        "not aligned": np.frombuffer(b"x" + good.tobytes(), good.dtype, offset=1)
        .reshape(good.shape),
    }
    kinds["read-only"] = good.copy()
    kinds["read-only"].flags.writeable = False
    try:
        import torch

        kinds["a tensor"] = torch.from_numpy(good.copy())
    except ImportError:
        pass
    return kinds


def numbers(result):
    """All arrays of a result, one after another."""
    if isinstance(result, (tuple, list)):
        return [array for item in result for array in numbers(item)]
    if isinstance(result, dict):
        return [array for _, item in sorted(result.items()) for array in numbers(item)]
    return [np.asarray(result)]


def refuse(call, value, what):
    # Documented: ValueError (Error is one), TypeError; MemoryError where a result is too large.
    with pytest.raises((ValueError, TypeError)) as raised:
        call(value)
    text = str(raised.value)
    assert len(text) > 10 and "incompatible function arguments" not in text, (what, text)
    words = ("expected", "finite", "out of range", "memory", "vertex", "missing", "no object",
             "neither")
    assert any(word in text for word in words), (what, text)


def array_rows():
    """(row, part, call, good, none, dear, gaps) of array arguments, meshes as vertices and faces."""
    for name, row in ROWS.items():
        if isinstance(row, Array):
            yield pytest.param(row.call, row.good, row.none, row.dear, row.gaps, id=name)
        if isinstance(row, Mesh):
            dear = "mesh" if row.dear else False
            yield pytest.param(lambda v, call=row.call: call((v, CUBE[1])), CUBE[0], False, dear,
                               False, id=name + "[0]")
            yield pytest.param(lambda v, call=row.call: call((CUBE[0], v)), CUBE[1], False, dear,
                               False, id=name + "[1]")


@pytest.mark.parametrize("call, good, none, dear, gaps", array_rows())
def test_arrays(call, good, none, dear, gaps):
    kinds = wrong(good, none, gaps)
    if dear == "mesh":  # meshes go through one door, which others try in full
        kinds = {what: kinds[what] for what in ("another axis", "objects", "too large", "None")}
    for what, value in kinds.items():
        refuse(call, value, what)
    if dear:
        return
    expected = numbers(call(good))
    for what, value in same(good).items():
        for found, right in zip(numbers(call(value)), expected):
            assert np.array_equal(found, right), what
    try:
        call(good[:0])  # nothing may be wrong, or nothing
    except (ValueError, TypeError, RuntimeError) as error:
        assert len(str(error)) > 10


@pytest.mark.parametrize("name", [name for name, row in ROWS.items() if isinstance(row, Mesh)])
def test_meshes(name):
    row = ROWS[name]
    mixed = [3, 3.0, object(), len, {}, (), (1,), (1, 2, 3), np.zeros((4, 3)), b"mug", [CUBE],
             (CUBE[0],), (None, CUBE[1]), (CUBE[0], None)]
    if "doctor" not in name:  # which says so in what it returns
        mixed.append("no such mesh")
    if not row.none:
        mixed.append(None)
    for value in mixed[:3] + mixed[-3:] if row.dear else mixed:
        refuse(row.call, value, repr(value))


@pytest.mark.parametrize("name", [name for name, row in ROWS.items() if isinstance(row, Person)])
def test_clips(name):
    row = ROWS[name]
    for value in [3, 3.0, object(), len, np.zeros((4, 165)), b"demo_drink", "no such clip"]:
        refuse(row.call, value, repr(value))
    if not row.none:
        refuse(row.call, None, "None")
