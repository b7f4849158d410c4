# SPDX-License-Identifier: MIT
# What _core binds, for editors and type checkers; the docstrings are in the module.
from os import PathLike
from typing import Any, Callable, Literal, Optional, Sequence, Union, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .results import Page

__version__: str
JOINT_NAMES: tuple[str, ...]

_Floats = NDArray[np.float64]
_Integers = NDArray[np.int32]
_Path = Union[str, PathLike[str]]
_Mesh = tuple[_Floats, _Integers]
_Object = Union[_Path, tuple[ArrayLike, ArrayLike]]
_Clip = Union["Clip", _Path]
_Shown = Union[
    _Clip, "FitResult", "RefineResult", "TransferResult", "GraspResult", "SynthesisResult", "ReachResult", "TakeResult"
]
_Hand = Literal["right", "left"]
_Progress = Optional[Callable[[str, int, int], Any]]

class Error(ValueError): ...
class FitFailure(RuntimeError): ...
class Stopped(RuntimeError): ...

class ObjectTrack:
    name: str
    mesh: str
    def __init__(
        self,
        trans: ArrayLike,
        orient: ArrayLike,
        name: str = "",
        mesh: str = "",
        surface: Optional[_Object] = None,
    ) -> None: ...
    @property
    def surface(self) -> Optional[_Mesh]: ...
    @property
    def trans(self) -> _Floats: ...
    @property
    def orient(self) -> _Floats: ...
    def __len__(self) -> int: ...

class Clip:
    frame_rate: float
    gender: str
    model_type: str
    body_model: str
    subject: str
    action: str
    def __init__(
        self,
        poses: ArrayLike,
        trans: ArrayLike,
        *,
        betas: Optional[ArrayLike] = None,
        frame_rate: float = 30.0,
        gender: str = "neutral",
        model_type: str = "smplx",
        object: Optional[ObjectTrack] = None,
        holding_hand: Optional[ArrayLike] = None,
    ) -> None: ...
    @property
    def poses(self) -> _Floats: ...
    @property
    def root_orient(self) -> _Floats: ...
    @property
    def pose_body(self) -> _Floats: ...
    @property
    def pose_jaw(self) -> _Floats: ...
    @property
    def pose_eye(self) -> _Floats: ...
    @property
    def pose_hand(self) -> _Floats: ...
    @property
    def trans(self) -> _Floats: ...
    @property
    def betas(self) -> _Floats: ...
    @betas.setter
    def betas(self, value: ArrayLike) -> None: ...
    @property
    def object(self) -> Optional[ObjectTrack]: ...
    def with_object(self, object: Optional[ObjectTrack]) -> Clip: ...
    @property
    def holding_hand(self) -> NDArray[np.uint8]: ...
    @holding_hand.setter
    def holding_hand(self, value: Optional[ArrayLike]) -> None: ...
    def __len__(self) -> int: ...
    def __getitem__(self, frames: slice) -> Clip: ...
    def copy(self) -> Clip: ...
    def resample(self, frame_rate: float) -> Clip: ...
    def to_smplx(self) -> dict[str, _Floats]: ...
    @staticmethod
    def from_smplx(
        parameters: dict[str, Any],
        frame_rate: float = 30.0,
        *,
        gender: str = "neutral",
        object: Optional[ObjectTrack] = None,
        holding_hand: Optional[ArrayLike] = None,
    ) -> Clip: ...
    @staticmethod
    def load(
        path: _Path,
        *,
        body: Optional[BodyModel] = None,
        frame_rate: Optional[float] = None,
        betas: Optional[ArrayLike] = None,
        hand_models: Sequence[str] = ...,
        source_fps: Optional[float] = None,
        meters_per_unit: Optional[float] = None,
        up: Literal["auto", "x", "y", "z", "-x", "-y", "-z"] = "auto",
        keep_ground: bool = False,
        map: str = "",
        asf: str = "",
        animation: str = "",
        character: str = "",
        prop: str = "",
        hands: Literal["body", "rhand", "lhand", "none"] = "body",
        flat_hand_mean: Literal["auto", "yes", "no"] = "auto",
        data_root: str = "",
        person: int = 0,
    ) -> Clip: ...
    def save(self, path: _Path, *, force: bool = False) -> None: ...
    def show(self, *, height: int = 720, **options: Any) -> Page: ...

def import_motion(
    path: Union[_Path, dict[str, Any]],
    *,
    body: Optional[BodyModel] = None,
    frame_rate: Optional[float] = None,
    betas: Optional[ArrayLike] = None,
    hand_models: Sequence[str] = ...,
    source_fps: Optional[float] = None,
    meters_per_unit: Optional[float] = None,
    up: Literal["auto", "x", "y", "z", "-x", "-y", "-z"] = "auto",
    keep_ground: bool = False,
    map: str = "",
    asf: str = "",
    animation: str = "",
    character: str = "",
    prop: str = "",
    hands: Literal["body", "rhand", "lhand", "none"] = "body",
    flat_hand_mean: Literal["auto", "yes", "no"] = "auto",
    data_root: str = "",
    person: int = 0,
) -> Clip: ...

class BodyModel:
    @staticmethod
    def load(path: Optional[_Path] = None) -> BodyModel: ...
    @property
    def name(self) -> str: ...
    @property
    def num_vertices(self) -> int: ...
    @property
    def num_shape(self) -> int: ...
    @property
    def faces(self) -> _Integers: ...
    @property
    def joint_names(self) -> tuple[str, ...]: ...
    @property
    def joint_parents(self) -> tuple[int, ...]: ...
    def hand_vertex_ids(self, side: Literal["right", "left"]) -> _Integers: ...
    def __call__(
        self,
        poses: ArrayLike,
        trans: Optional[ArrayLike] = None,
        betas: Optional[ArrayLike] = None,
        vertex_ids: Optional[ArrayLike] = None,
        threads: int = 0,
    ) -> tuple[_Floats, _Floats]: ...
    def vjp(
        self,
        poses: ArrayLike,
        trans: Optional[ArrayLike],
        betas: Optional[ArrayLike],
        grad_vertices: Optional[ArrayLike] = None,
        grad_joints: Optional[ArrayLike] = None,
        vertex_ids: Optional[ArrayLike] = None,
        threads: int = 0,
        *,
        with_betas: bool = False,
    ) -> tuple[_Floats, ...]: ...

class SignedDistance:
    def __init__(
        self,
        mesh: Union[_Object, ArrayLike],
        faces: Optional[ArrayLike] = None,
        *,
        cell: float = 0.0,
        padding: float = 0.02,
        threads: int = 0,
    ) -> None: ...
    @property
    def watertight(self) -> bool: ...
    @property
    def cell(self) -> float: ...
    def __call__(self, points: ArrayLike, threads: int = 0) -> _Floats: ...
    def gradient(self, points: ArrayLike, threads: int = 0) -> tuple[_Floats, _Floats]: ...

def object_names() -> list[str]: ...
def load_mesh(path_or_name: _Object, scale: float = 1.0) -> _Mesh: ...
def decimate(
    mesh: _Object,
    vertices: int = 300,
    *,
    method: str = "lindstrom-turk",
    allow_wrap: bool = True,
) -> _Mesh: ...
def check_mesh(mesh: _Object) -> dict[str, Any]: ...
def doctor(clip_or_mesh: Union[_Clip, _Object]) -> list[dict[str, str]]: ...
def intersection_volume(
    mesh_a: _Object,
    mesh_b: _Object,
    exact: bool = True,
    *,
    voxel: float = 0.002,
    threads: int = 0,
) -> float: ...
def load_pickle_safe(path: _Path) -> Any: ...
def pair_distances(hand: ArrayLike, object: ArrayLike) -> _Floats: ...
def distance_energy(
    hand: ArrayLike, object: ArrayLike, reference: ArrayLike, *, threads: int = 0
) -> tuple[float, _Floats, _Floats]: ...
def contact_energy(
    hand: ArrayLike, object: ArrayLike, reference: ArrayLike, threshold_m: float = 0.01
) -> tuple[float, _Floats, _Floats]: ...
def penetration_energy(
    points: ArrayLike, signed_distance: SignedDistance, give_m: float = 0.0, *, threads: int = 0
) -> tuple[float, _Floats]: ...

class FitResult:
    @property
    def clip(self) -> Clip: ...
    @property
    def status(self) -> str: ...
    @property
    def held_by(self) -> str: ...
    @property
    def warnings(self) -> list[str]: ...
    @property
    def metrics(self) -> dict[str, Any]: ...
    @property
    def energies(self) -> dict[str, _Floats]: ...
    @property
    def per_frame(self) -> dict[str, Any]: ...
    @property
    def contact(self) -> dict[str, Any]: ...
    @property
    def grasp(self) -> dict[str, Any]: ...
    @property
    def clearance(self) -> dict[str, Any]: ...
    @property
    def drink(self) -> Optional[dict[str, Any]]: ...
    @property
    def switches(self) -> list[dict[str, Any]]: ...
    @property
    def seconds(self) -> float: ...
    @property
    def object(self) -> _Mesh: ...
    @property
    def object_name(self) -> str: ...
    def save(self, folder: _Path, *, force: bool = False) -> None: ...
    def show(self, *, height: int = 720, **options: Any) -> Page: ...

def options(
    job: Literal[
        "export", "fit", "grasp", "import_motion", "reach", "refine", "score", "solve_keypoints",
        "solve_markers", "synthesize", "transfer", "transfer_to_robot"
    ],
) -> dict[str, dict[str, Any]]: ...
def fit(
    clip: _Clip,
    object: Optional[_Object] = None,
    *,
    hand: str = "auto",
    style: str = "auto",
    use: str = "auto",
    at: Optional[ArrayLike] = None,
    region: Optional[_Object] = None,
    avoid: Optional[_Object] = None,
    avoid_balls: Optional[ArrayLike] = None,
    start: int = 0,
    end: int = -1,
    regrasp: bool = False,
    keep_grasp: bool = False,
    first_grasp: _Path = "",
    first_grasp_body: _Path = "",
    keep_motion: bool = False,
    drink: bool = False,
    drinking: str = "auto",
    recipe: str = "holdfast",
    solve: str = "sequential",
    weights: Optional[dict[str, float]] = None,
    contact_threshold_mm: float = 10.0,
    slip: bool = False,
    hand_over: bool = False,
    first_hand: str = "auto",
    switch_frames: Optional[ArrayLike] = None,
    max_switches: int = ...,
    dwell_s: float = ...,
    object_scale: float = 1.0,
    object_vertices: int = 300,
    max_iterations: int = ...,
    precision: str = "single",
    normalize: str = "sum",
    custom_terms: Optional[Sequence[CustomTerm]] = None,
    body: Optional[BodyModel] = None,
    seed: int = 1,
    threads: int = 0,
    progress: _Progress = None,
    **lambdas: float,
) -> FitResult: ...
def offhand(clip: _Clip, object: Optional[_Object] = None, **options: Any) -> FitResult: ...

class RefineResult:
    @property
    def clip(self) -> Clip: ...
    @property
    def before(self) -> dict[str, Any]: ...
    @property
    def after(self) -> dict[str, Any]: ...
    @property
    def gaps(self) -> tuple[_Floats, _Floats]: ...
    @property
    def distance(self) -> dict[str, Any]: ...
    @property
    def holds(self) -> list[dict[str, Any]]: ...
    @property
    def rests(self) -> list[dict[str, Any]]: ...
    @property
    def touches(self) -> list[dict[str, Any]]: ...
    @property
    def kept(self) -> list[dict[str, Any]]: ...
    @property
    def clearance(self) -> dict[str, Any]: ...
    @property
    def fingers(self) -> list[dict[str, Any]]: ...
    @property
    def ball(self) -> bool: ...
    @property
    def solve(self) -> dict[str, Any]: ...
    @property
    def object(self) -> _Mesh: ...
    def save(self, folder: _Path, *, force: bool = False) -> None: ...
    def show(self, *, height: int = 720, **options: Any) -> Page: ...

def refine(
    clip: _Clip,
    object: Optional[_Object] = None,
    *,
    hand: str = "auto",
    weights: Optional[dict[str, float]] = None,
    object_scale: float = 1.0,
    object_vertices: int = 300,
    keep_motion: bool = False,
    body: Optional[BodyModel] = None,
    threads: int = 0,
    progress: _Progress = None,
    **lambdas: float,
) -> RefineResult: ...

class RobotHand:
    def __init__(self, path: _Path) -> None: ...
    @property
    def name(self) -> str: ...
    @property
    def notes(self) -> list[str]: ...
    @property
    def joints(self) -> dict[str, tuple[float, float]]: ...
    @property
    def parts(self) -> list[tuple[str, str]]: ...

class RobotTransfer:
    @property
    def robot(self) -> RobotHand: ...
    @property
    def joint_angles(self) -> _Floats: ...
    @property
    def wrist(self) -> tuple[_Floats, _Floats]: ...
    @property
    def contacts(self) -> list[dict[str, Any]]: ...
    @property
    def metrics(self) -> dict[str, Any]: ...
    @property
    def human_metrics(self) -> dict[str, Any]: ...
    @property
    def solve_ms(self) -> float: ...
    def baseline(
        self, method: Literal["laplacian", "keypoints", "fingertip-vectors"]
    ) -> RobotTransfer: ...
    def hold_trial(
        self, human: bool = False, *, friction: float = ...
    ) -> Optional[dict[str, Any]]: ...
    def play(self) -> dict[str, Any]: ...
    def save(self, path: _Path, *, force: bool = False) -> None: ...
    def save_scene(self, path: _Path, *, force: bool = False) -> None: ...

def transfer_to_robot(
    clip: _Clip,
    robot: _Path,
    *,
    hand: str = "auto",
    correspondence: Optional[Sequence[tuple[str, str]]] = None,
    contacts: str = "",
    robot_on_path: bool = False,
    object: Optional[_Object] = None,
    object_scale: float = 1.0,
    body: Optional[BodyModel] = None,
    threads: int = 0,
    progress: _Progress = None,
) -> RobotTransfer: ...
class TransferResult:
    @property
    def clip(self) -> Clip: ...
    @property
    def map(self) -> dict[str, Any]: ...
    @property
    def holds(self) -> list[dict[str, Any]]: ...
    @property
    def following(self) -> dict[str, Any]: ...
    @property
    def contact(self) -> dict[str, Any]: ...
    @property
    def warnings(self) -> list[str]: ...
    @property
    def object(self) -> _Mesh: ...
    def save(self, folder: _Path, *, force: bool = False) -> None: ...
    def show(self, *, height: int = 720, **options: Any) -> Page: ...

def transfer(
    clip: _Clip,
    object: Optional[_Object] = None,
    *,
    scale: Union[float, ArrayLike, None] = None,
    map: Union[_Path, tuple[ArrayLike, ArrayLike], None] = None,
    betas: Optional[ArrayLike] = None,
    keep: str = "auto",
    search: bool = True,
    keep_motion: bool = False,
    from_object: Optional[_Object] = None,
    object_scale: float = 1.0,
    object_vertices: int = 300,
    body: Optional[BodyModel] = None,
    seed: int = 1,
    threads: int = 0,
    progress: _Progress = None,
) -> TransferResult: ...

def read_markers(path: _Path) -> dict[str, Any]: ...
def write_markers(
    path: _Path, recording: Union[_Path, dict[str, Any]], *, force: bool = False
) -> None: ...
def solve_markers(
    recording: Union[_Path, dict[str, Any]],
    *,
    static: Union[_Path, dict[str, Any], None] = None,
    table: Optional[_Path] = None,
    up: str = "auto",
    posture: str = "seated",
    object: Optional[_Object] = None,
    object_markers: Union[_Path, dict[str, Sequence[float]], None] = None,
    object_scale: float = 1.0,
    body: Optional[BodyModel] = None,
    progress: _Progress = None,
) -> tuple[Clip, dict[str, Any]]: ...

def solve_keypoints(
    keypoints: Union[_Path, ArrayLike],
    *,
    hand: str = "auto",
    order: str = "auto",
    meters_per_unit: Optional[float] = None,
    up: str = "auto",
    fps: float = 30.0,
    progress: _Progress = None,
) -> tuple[Clip, dict[str, Any]]: ...

class GraspResult:
    @property
    def clip(self) -> Clip: ...
    @property
    def hand(self) -> str: ...
    @property
    def numbers(self) -> dict[str, Any]: ...
    @property
    def object(self) -> _Mesh: ...
    def save(self, folder: _Path, *, force: bool = False) -> None: ...
    def show(self, *, height: int = 720, **options: Any) -> Page: ...

def grasp(
    object: _Object,
    *,
    hand: str = "auto",
    style: str = "auto",
    use: str = "auto",
    at: Optional[ArrayLike] = None,
    region: Optional[_Object] = None,
    avoid: Optional[_Object] = None,
    avoid_balls: Optional[ArrayLike] = None,
    clip: Optional[_Clip] = None,
    body: Optional[BodyModel] = None,
    object_scale: float = 1.0,
    closings: int = ...,
    refinements: int = ...,
    friction: float = ...,
    upright: float = ...,
    seed: int = 1,
    threads: int = 0,
    progress: _Progress = None,
) -> GraspResult: ...
def grasps(
    object: _Object,
    count: int = ...,
    *,
    hand: str = "auto",
    style: str = "auto",
    use: str = "auto",
    at: Optional[ArrayLike] = None,
    region: Optional[_Object] = None,
    avoid: Optional[_Object] = None,
    avoid_balls: Optional[ArrayLike] = None,
    body: Optional[BodyModel] = None,
    object_scale: float = 1.0,
    friction: float = ...,
    apart_cm: float = ...,
    apart_angle_deg: float = ...,
    trial_friction: Optional[float] = None,
    seed: int = 1,
    threads: int = 0,
    progress: _Progress = None,
) -> dict[str, Any]: ...

class CustomTerm:
    def __init__(
        self,
        name: str,
        blocks: Sequence[str],
        function: Callable[..., Any],
        num_residuals: int,
        *,
        weight: float = 1.0,
    ) -> None: ...
    @property
    def name(self) -> str: ...
    weight: float

class FrameFitter:
    def __init__(
        self,
        object: _Object,
        hand: Union[_Hand, Literal["both"], Sequence[_Hand]] = "right",
        *,
        weights: Optional[dict[str, float]] = None,
        contact_threshold_mm: float = 10.0,
        slip: bool = False,
        body: Optional[BodyModel] = None,
        betas: Optional[ArrayLike] = None,
        frame_rate: float = 30.0,
        object_scale: float = 1.0,
        object_vertices: int = 300,
        custom_terms: Optional[Sequence[CustomTerm]] = None,
        threads: int = 0,
    ) -> None: ...
    def start(
        self,
        poses: ArrayLike,
        trans: ArrayLike,
        object_rotation: ArrayLike,
        object_translation: ArrayLike,
    ) -> tuple[_Floats, _Floats, _Floats]: ...
    def step(self, poses: ArrayLike, trans: ArrayLike) -> tuple[_Floats, _Floats, _Floats]: ...
    @property
    def poses(self) -> _Floats: ...
    @property
    def report(self) -> dict[str, Any]: ...
    @property
    def hand(self) -> str: ...
    @property
    def object(self) -> _Mesh: ...

class ReachResult:
    @property
    def clips(self) -> list[Clip]: ...
    @property
    def clip(self) -> Clip: ...
    @property
    def reached(self) -> NDArray[np.bool_]: ...
    @property
    def misses(self) -> list[Optional[str]]: ...
    @property
    def goals(self) -> list[dict[str, Any]]: ...
    @property
    def quality(self) -> list[dict[str, Any]]: ...
    @property
    def warnings(self) -> list[str]: ...
    @property
    def seconds(self) -> float: ...
    def save(self, folder: _Path, *, force: bool = False) -> None: ...
    def show(self, *, height: int = 720, **options: Any) -> Page: ...

class TakeResult:
    @property
    def clip(self) -> Clip: ...
    @property
    def hand(self) -> str: ...
    @property
    def object(self) -> _Mesh: ...
    @property
    def table(self) -> _Mesh: ...
    @property
    def take(self) -> dict[str, Any]: ...
    @property
    def quality(self) -> dict[str, Any]: ...
    @property
    def per_frame(self) -> dict[str, list[float]]: ...
    @property
    def warnings(self) -> list[str]: ...
    def save(self, folder: _Path, *, force: bool = False) -> None: ...
    def show(self, *, height: int = 720, **options: Any) -> Page: ...

@overload
def reach(goals: ArrayLike, *, object: _Object, **options: Any) -> TakeResult: ...
@overload
def reach(
    goals: ArrayLike,
    *,
    clip: Optional[_Clip] = None,
    frame: Optional[int] = None,
    object: None = None,
    grasp: Literal["auto", "power", "precision", "handle"] = "auto",
    object_yaw_deg: Optional[float] = None,
    object_scale: float = 1.0,
    wrist: Literal["right", "left"] = "right",
    method: Literal["auto", "intention", "latent-opt", "vae-opt"] = "auto",
    optimizer: Literal["auto", "lm", "lbfgs", "lbfgs-step1", "adam"] = "auto",
    iterations: Optional[int] = None,
    prior_weight: Optional[float] = None,
    samples: Optional[int] = None,
    time_s: Optional[float] = None,
    sigma: float = 1.0,
    refit: bool = True,
    refit_all: bool = False,
    free_time: bool = False,
    approach: Optional[ArrayLike] = None,
    obstacles: Optional[list[_Object]] = None,
    weights: str = "",
    body: Optional[BodyModel] = None,
    seed: int = 1,
    threads: int = 0,
    progress: _Progress = None,
) -> ReachResult: ...

class GoalFollower:
    def __init__(
        self,
        *,
        clip: Optional[_Clip] = None,
        frame: Optional[int] = None,
        wrist: Literal["right", "left"] = "right",
        candidates: int = 48,
        horizon: int = 14,
        sigma: float = 0.7,
        weights: str = "",
        body: Optional[BodyModel] = None,
        seed: int = 1,
    ) -> None: ...
    def step(self, goal: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]: ...
    def push(self, by: ArrayLike) -> None: ...
    @property
    def clip(self) -> Clip: ...

class SynthesisResult:
    @property
    def clip(self) -> Clip: ...
    @property
    def motion(self) -> Clip: ...
    @property
    def fit(self) -> FitResult: ...
    @property
    def action(self) -> str: ...
    @property
    def object_class(self) -> str: ...
    @property
    def sentence(self) -> str: ...
    @property
    def samples(self) -> list[dict[str, Any]]: ...
    @property
    def switch_frame(self) -> Optional[int]: ...
    @property
    def at_face_m(self) -> Optional[float]: ...
    @property
    def seconds_per_key_frame(self) -> float: ...
    def save(self, folder: _Path, *, force: bool = False) -> None: ...
    def show(self, *, height: int = 720, **options: Any) -> Page: ...

def synthesize(
    action: str,
    object: _Object,
    *,
    object_class: str = "",
    clip: Optional[_Clip] = None,
    frame: Optional[int] = None,
    start: Literal["any", "table", "hand"] = "any",
    hand: Literal["right", "left"] = "right",
    betas: Optional[ArrayLike] = None,
    samples: int = 8,
    seconds: Optional[float] = None,
    key_frames: int = ...,
    sigma: float = 1.0,
    style: float = 1.0,
    frame_rate: float = 30.0,
    and_back: bool = True,
    object_scale: float = 1.0,
    weights: str = "",
    action_vectors: str = "",
    body: Optional[BodyModel] = None,
    seed: int = 1,
    threads: int = 0,
    progress: _Progress = None,
) -> SynthesisResult: ...
def score(
    clip: _Shown,
    object: Optional[_Object] = None,
    reference: Optional[_Shown] = None,
    *,
    exact: Literal["off", "auto", "on"] = "auto",
    contact_threshold_mm: float = 5.0,
    depth_threshold_mm: float = 2.0,
    voxel_mm: float = 2.0,
    symmetric: Literal["off", "auto", "on"] = "auto",
    protocol: Literal["none", "grab", "dexgraspnet", "graspqp", "contactopt", "v2d"] = "none",
    overlap: bool = False,
    resample: bool = False,
    per_frame: bool = False,
    object_scale: float = 1.0,
    body: Optional[BodyModel] = None,
    threads: int = 0,
    progress: _Progress = None,
) -> dict[str, Any]: ...
def hold_trial(
    clip: _Shown,
    object: Optional[_Object] = None,
    *,
    object_scale: float = 1.0,
    body: Optional[BodyModel] = None,
    friction: float = ...,
    film: Optional[_Path] = None,
    force: bool = False,
    threads: int = 0,
) -> Optional[dict[str, Any]]: ...
@overload
def render(clip: _Shown, path: None = None, **options: Any) -> NDArray[np.uint8]: ...
@overload
def render(
    clip: _Shown,
    path: _Path,
    *,
    object: Optional[_Object] = None,
    object_scale: float = 1.0,
    body: Optional[BodyModel] = None,
    camera: Literal["auto", "front", "side", "follow", "hand"] = "auto",
    azimuth_deg: Optional[float] = None,
    elevation_deg: Optional[float] = None,
    sheet: tuple[int, int] = (4, 2),
    frame: Optional[int] = None,
    every: int = 1,
    fps: Optional[float] = None,
    size: tuple[int, int] = (640, 480),
    supersampling: int = 2,
    contact: bool = True,
    markers: Optional[_Path] = None,
    force: bool = False,
    threads: int = 0,
    progress: _Progress = None,
) -> None: ...
def report(
    clips: Union[_Shown, Sequence[_Shown], dict[str, _Shown]],
    path: _Path,
    *,
    object: Optional[_Object] = None,
    object_scale: float = 1.0,
    body: Optional[BodyModel] = None,
    contact_threshold_mm: float = 5.0,
    title: str = "",
    force: bool = False,
    threads: int = 0,
    progress: _Progress = None,
) -> None: ...
def export(
    clip: _Shown,
    path: _Path,
    *,
    object: Optional[_Object] = None,
    object_scale: float = 1.0,
    body: Optional[BodyModel] = None,
    onto: Optional[_Path] = None,
    correctives: bool = True,
    tolerance_mm: float = 0.02,
    density: Optional[float] = None,
    every: int = 1,
    force: bool = False,
    threads: int = 0,
    progress: _Progress = None,
) -> dict[str, Any]: ...

class ConvertResult:
    @property
    def clip(self) -> Clip: ...
    @property
    def body(self) -> BodyModel: ...
    @property
    def residual(self) -> dict[str, Any]: ...
    @property
    def arm(self) -> Optional[dict[str, Any]]: ...
    @property
    def not_carried_over(self) -> list[str]: ...
    def save(
        self,
        path: _Path,
        *,
        layout: Literal["auto", "amass", "smplx", "smplh", "mano"] = "auto",
        to_hands: Literal["complete", "relative"] = "complete",
        force: bool = False,
    ) -> None: ...
    def show(self, *, height: int = 720, **options: Any) -> Page: ...

def convert(
    clip: _Clip,
    *,
    to_body: Optional[BodyModel],
    from_body: Optional[BodyModel] = None,
    from_hands: Literal["auto", "complete", "relative"] = "auto",
    betas: int = 10,
    onto: Optional[_Clip] = None,
) -> ConvertResult: ...

def read_jobs(path: _Path) -> list[dict[str, Any]]: ...
def find_marker_trials(folder: _Path) -> list[dict[str, Any]]: ...
def joint_positions(clip: _Clip, body: Optional[BodyModel] = None) -> _Floats: ...
def find_holds(
    clip: _Clip,
    object: Optional[_Object] = None,
    *,
    object_scale: float = 1.0,
    cell: float = ...,
    body: Optional[BodyModel] = None,
    threads: int = 0,
) -> dict[str, Any]: ...
def find_handovers(
    clip: _Clip, object_size: float, *, body: Optional[BodyModel] = None
) -> dict[str, Any]: ...
def handover_clip(
    object: _Object,
    *,
    seed: int = 1,
    frame_rate: float = 30.0,
    switches: int = 0,
    noise: tuple[float, float, float] = (0.0, 0.0, 0.0),
    object_scale: float = 1.0,
    body: Optional[BodyModel] = None,
) -> tuple[Clip, list[int]]: ...
def reach_starts(
    clips: Optional[Sequence[_Clip]] = None, *, single_precision: bool = True, weights: str = ""
) -> dict[str, Any]: ...
def reach_motions(
    method: Literal[
        "intention", "latent-opt", "vae-opt-lm", "vae-opt-lbfgs", "vae-opt-lbfgs-step1", "vae-opt-adam"
    ],
    states: ArrayLike,
    previous_deltas: ArrayLike,
    goals: ArrayLike,
    deadlines: ArrayLike,
    streams: ArrayLike,
    *,
    frames: int = 240,
    sigma: float = 1.0,
    parts: Sequence[Literal["wrist", "pelvis", "heading"]] = ...,
    with_intention: bool = True,
    min_frames_left: float = 1.0,
    hold_last_goal: bool = False,
    pace_m_s: float = 0.0,
    refit: bool = False,
    weights: str = "",
    seed: int = 1,
    threads: int = 1,
) -> list[dict[str, Any]]: ...
def walk(
    clip: _Clip, *, body: Optional[BodyModel] = None, skating: bool = False
) -> dict[str, Any]: ...
def random_draws(seed: int, count: int) -> _Floats: ...

class ActionCase:
    @property
    def subject(self) -> str: ...
    @property
    def name(self) -> str: ...
    @property
    def action(self) -> str: ...
    @property
    def action_id(self) -> int: ...
    @property
    def clip(self) -> Clip: ...
    @property
    def keys(self) -> Clip: ...
    def joints(self, keys: Clip) -> _Floats: ...
    def object_from_head(self, keys: Clip) -> _Floats: ...
    def in_motion(self, keys: Clip, frame_rate: float = 30.0) -> Clip: ...
    def score(self, clip: Clip) -> dict[str, Optional[float]]: ...
    def generate(
        self,
        objects: Literal["given", "carried", "fitted"],
        *,
        weights: str = "",
        stream: int = 0,
        stroke_seed: int = 1,
        sigma: float = 1.0,
        finish: bool = False,
        seed: int = 1,
    ) -> dict[str, Any]: ...

def action_case(
    path: str, *, key_frames: Literal["whole", "paper"] = "whole"
) -> Optional[ActionCase]: ...
def synthesis_network(weights: str = "") -> dict[str, Any]: ...
