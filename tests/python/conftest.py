# SPDX-License-Identifier: MIT
import numpy as np
import pytest

import holdfast


@pytest.fixture(scope="session")
def held():
    """Twelve frames of the embedded motion with a mug in the hand; not to be changed."""
    return holdfast.fit(holdfast.Clip.load("demo_drink")[:12], "mug")


@pytest.fixture(scope="session")
def demo(held):
    """Eight frames of its clip; not to be changed."""
    return held.clip[:8]


@pytest.fixture(scope="session")
def has_player(tmp_path_factory):
    """Whether the library was built with the player of reports."""
    page = tmp_path_factory.mktemp("player") / "page.html"
    try:
        holdfast.report(holdfast.Clip.load("demo_drink")[:1], page)
    except holdfast.Error as error:
        if "HOLDFAST_BUILD_PLAYER" not in str(error):
            raise
        return False
    return True


@pytest.fixture
def random():
    return np.random.default_rng(7)
