# SPDX-License-Identifier: MIT
"""Fits objects to moving human hands, and human motion to goals.

>>> import holdfast
>>> held = holdfast.fit("demo_drink", "mug")
>>> held.clip.save("held.npz")

Arrays are numpy's, frames first; meters, radians, z up. docs/python.md has a table of all there is.
holdfast.torch (imported apart, needs PyTorch) has the body model and the energy terms for learning.
"""

from . import _core, results
from ._core import *  # noqa: F403
from ._core import __version__

__all__ = sorted(name for name in vars(_core) if not name.startswith("_"))
