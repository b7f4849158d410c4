# SPDX-License-Identifier: MIT
"""A held mug over to another size, another mesh and another person."""
import numpy as np
import pytest

import holdfast
from support import refused


@pytest.fixture(scope="module")
def held():
    return holdfast.fit(holdfast.Clip.load("demo_drink")[:6], "mug")


def test_a_larger_mug_is_held_as_the_first_one_was(held):
    large = holdfast.transfer(held, scale=1.2)
    assert large.contact["frames_in_contact_ratio"] == 1.0
    assert large.contact["frames_deeper_than_2_mm"] == 0
    assert large.holds[0]["clean"] and not large.holds[0]["searched"]
    assert large.map["method"] == "scaled"
    assert np.allclose(np.ptp(large.object[0], axis=0), 1.2 * np.ptp(held.object[0], axis=0))


def test_points_that_belong_together_lead_to_another_mesh(held):
    vertices, faces = held.object
    other = vertices * [1.1, 1.1, 0.9]
    given = holdfast.transfer(held.clip, (other, faces), map=(vertices[::5], other[::5]))
    assert given.map["method"] == "given"
    assert given.contact["frames_in_contact_ratio"] == 1.0


def test_another_person_has_the_object_where_it_was(held):
    short = holdfast.transfer(held.clip, betas=[-2.0, 1.0])
    assert short.following["kept"] == "object"
    assert np.abs(short.clip.object.trans - held.clip.object.trans).max() < 0.08


def test_what_is_no_scale_and_no_map_is_refused(held):
    for scale in (0.0, -1.0, float("nan"), 1e9):
        refused(ValueError, "", holdfast.transfer, held.clip, scale=scale)
    refused(ValueError, "map: needs object", holdfast.transfer, held.clip, map=(np.eye(3), np.eye(3)))
    refused(TypeError, "map: expected", holdfast.transfer, held.clip, "mug", map=3)
    refused(holdfast.Error, "has no object", holdfast.transfer, "demo_drink", scale=1.1)
