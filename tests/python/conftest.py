# SPDX-License-Identifier: MIT
import numpy as np
import pytest

import holdfast


@pytest.fixture(scope="session")
def demo():
    """Eight frames of the embedded motion with a mug in the hand; not to be changed."""
    return holdfast.fit(holdfast.Clip.load("demo_drink")[:8], "mug").clip


@pytest.fixture
def random():
    return np.random.default_rng(7)
