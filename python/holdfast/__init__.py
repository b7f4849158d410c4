# SPDX-License-Identifier: MIT
"""Fits objects to moving human hands and generates human motion that reaches goals.

>>> import holdfast
>>> held = holdfast.fit("demo_drink", "mug")
>>> held.clip.save("held.npz")

Arrays are numpy's, frames first; meters, radians, z up. docs/python.md lists all functions and
classes. holdfast.torch (a separate import, needs PyTorch) has the body model and the energy terms as
differentiable functions.
"""

from . import _core, results
from ._core import *  # noqa: F403
from ._core import __version__

__all__ = sorted(name for name in vars(_core) if not name.startswith("_"))
