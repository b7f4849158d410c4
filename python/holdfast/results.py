# SPDX-License-Identifier: MIT
"""What Clip and all results share: pickling, saving, and the player in a notebook."""

import html
import json
import math
import pathlib
import pickle
import tempfile

import numpy as np

from . import _core

_RESULTS = ("ConvertResult", "FitResult", "GraspResult", "ReachResult", "RefineResult", "RobotTransfer",
            "SynthesisResult", "TakeResult", "TransferResult")


def arrays(value):
    """Tensors as arrays, in dicts and lists as well."""
    if isinstance(value, dict):
        return {str(key): arrays(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [arrays(item) for item in value]
    return value.detach().cpu().numpy() if hasattr(value, "detach") else value


class stored_parameters:
    """A dict of parameters as a file, for the importer; gone with this object."""

    def __init__(self, parameters):
        self.folder = tempfile.TemporaryDirectory()
        self.path = pathlib.Path(self.folder.name) / "parameters.pkl"
        with open(self.path, "wb") as file:
            pickle.dump(arrays(parameters), file, protocol=4)


class Page:
    """The report of a clip, for notebooks: the last value of a cell shows the player.

    Parameters
    ----------
    page : str
        The whole page, self-contained (2 to 6 MB): the attribute html.
    height : int
        Height of the player, pixels.
    """

    def __init__(self, page, height):
        self.html, self.height = page, height

    def _repr_html_(self):
        return (f'<iframe srcdoc="{html.escape(self.html)}" style="width:100%;height:{self.height}px;border:0">'
                "</iframe>")

    def __repr__(self):
        return f"<holdfast player, {len(self.html) / 1e6:.1f} MB of HTML>"


def show(self, *, height=720, **options):
    """Shows the 3D player of report.html in a notebook.

    The page becomes part of the notebook, with 2 to 6 MB for each player.

    Parameters
    ----------
    height : int, default 720
        Height of the player, pixels.
    **options
        Options of report() (object, body, ...).

    Returns
    -------
    Page
    """
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "report.html"
        _core.report(self, path, **options)
        return Page(path.read_text(encoding="utf-8"), height)


def _player(self):
    try:
        return show(self)._repr_html_()
    except (_core.Error, TypeError):  # nothing to show: the notebook falls back to repr()
        return None


def _attributes(result):
    if isinstance(result, StoredResult):
        return {name: value for name, value in vars(result).items() if not name.startswith("_")}
    kind = type(result)
    return {name: getattr(result, name) for name in dir(kind)
            if not name.startswith("_") and isinstance(getattr(kind, name), property)}


class StoredResult:
    """A result that was pickled or copied: its attributes, save() and show(), without the methods
    that compute."""

    def __init__(self, kind, attributes):
        self.__dict__.update(attributes)
        self._kind = kind

    def __repr__(self):
        return f"<holdfast.{self._kind}, stored>"


def _reduce(self):
    return StoredResult, (type(self).__name__, _attributes(self))


# pickle finds Python's functions by name, but not those of the extension.
def _restored(kind, state):
    if kind == "Clip":
        return _core._clip(state)
    return _core.BodyModel.load(*state) if kind == "BodyModel" else getattr(_core, kind)(*state)


def _reduce_input(self):
    return _restored, (type(self).__name__, _core._state(self))


def _plain(value):
    """The numbers and texts of a value for JSON; None for meshes and clips."""
    if isinstance(value, np.ndarray):
        return value.tolist() if value.ndim < 2 else None
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value if isinstance(value, (bool, int, float, str)) else None


def save(self, folder, *, force=False):
    """Writes the result to a folder.

    Writes clip.npz, object.ply if the clip holds an object, and metrics.json with the measures of
    the result.

    Parameters
    ----------
    folder : path
        Created if needed.
    force : bool, default False
        Overwrite existing files.

    Raises
    ------
    Error
        If one of the files exists, unless force=True.
    """
    if not hasattr(self, "clip"):
        raise TypeError(f"{self!r} has no clip to save")
    measures = _plain(self.metrics if hasattr(self, "metrics") else {
        name: value for name, value in _attributes(self).items() if name not in ("clip", "clips", "object")})
    surface = self.clip.object.surface if self.clip.object else None
    _core._save(self.clip, surface, folder, json.dumps(measures, indent=1), force)


def attach():
    for name in _RESULTS:
        kind = getattr(_core, name)
        kind.__reduce__ = _reduce
        if not hasattr(kind, "save"):
            kind.save = save
        if hasattr(kind, "clip"):
            kind.show, kind._repr_html_ = show, _player
    for kind in (_core.Clip, _core.ObjectTrack, _core.BodyModel, _core.RobotHand):
        kind.__reduce__ = _reduce_input
    _core.Clip.show, _core.Clip._repr_html_ = show, _player
    StoredResult.save, StoredResult.show = save, show


attach()
