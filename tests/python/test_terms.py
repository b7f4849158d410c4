# SPDX-License-Identifier: MIT
import numpy as np
import pytest

import holdfast
from support import refused


def differences(energy, x, step=1e-6):
    """Central differences of energy at x."""
    gradient = np.zeros_like(x)
    for i in np.ndindex(x.shape):
        ends = []
        for sign in (1.0, -1.0):
            moved = x.copy()
            moved[i] += sign * step
            ends.append(energy(moved))
        gradient[i] = (ends[0] - ends[1]) / (2 * step)
    return gradient


@pytest.fixture
def pairs(random):
    hand = 0.05 * random.standard_normal((11, 3))
    object = 0.05 * random.standard_normal((19, 3))
    reference = np.linalg.norm(hand[:, None] - object, axis=2)
    return hand + 0.01 * random.standard_normal(hand.shape), object, reference


def test_pair_distances(pairs):
    hand, object, _ = pairs
    expected = np.linalg.norm(hand[:, None] - object, axis=2)
    np.testing.assert_allclose(holdfast.pair_distances(hand, object), expected, rtol=1e-12)
    assert holdfast.pair_distances(np.zeros((0, 3)), object).shape == (0, 19)


def test_distance_energy(pairs):
    hand, object, reference = pairs
    energy, grad_hand, grad_object = holdfast.distance_energy(hand, object, reference)
    off = np.linalg.norm(hand[:, None] - object, axis=2) - reference
    assert energy == pytest.approx((off**2).sum(), rel=1e-12)
    of_hand = differences(lambda h: holdfast.distance_energy(h, object, reference)[0], hand)
    of_object = differences(lambda o: holdfast.distance_energy(hand, o, reference)[0], object)
    np.testing.assert_allclose(grad_hand, of_hand, atol=1e-8)
    np.testing.assert_allclose(grad_object, of_object, atol=1e-8)


def test_distance_energy_of_many_pairs_on_threads(random):
    hand, object = random.standard_normal((1500, 3)), random.standard_normal((701, 3))
    reference = np.abs(random.standard_normal((1500, 701)))
    one = holdfast.distance_energy(hand, object, reference, threads=1)
    two = holdfast.distance_energy(hand, object, reference, threads=2)
    for a, b in zip(one, two):
        np.testing.assert_array_equal(a, b)
    apart = hand[:, None] - object
    length = np.linalg.norm(apart, axis=2)
    pull = 2 * ((length - reference) / length)[..., None] * apart
    np.testing.assert_allclose(one[1], pull.sum(1), rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(one[2], -pull.sum(0), rtol=1e-9, atol=1e-9)


def test_coinciding_points_have_no_direction():
    energy, grad_hand, grad_object = holdfast.distance_energy([[1, 2, 3]], [[1, 2, 3]], [[0.5]])
    assert energy == pytest.approx(0.25)
    assert not grad_hand.any() and not grad_object.any()


def test_contact_energy(pairs):
    hand, object, reference = pairs
    threshold = 0.06
    energy, grad_hand, grad_object = holdfast.contact_energy(hand, object, reference, threshold)
    touching = reference < threshold
    assert 0 < touching.sum() < touching.size
    squares = ((hand[:, None] - object) ** 2).sum(2)
    assert energy == pytest.approx(squares[touching].sum(), rel=1e-12)

    def of(h, o):
        return holdfast.contact_energy(h, o, reference, threshold)[0]

    np.testing.assert_allclose(grad_hand, differences(lambda h: of(h, object), hand), atol=1e-8)
    np.testing.assert_allclose(grad_object, differences(lambda o: of(hand, o), object), atol=1e-8)


@pytest.fixture
def ball():
    """The signed distance of an octahedron of radius 5 cm."""
    corners = 0.05 * np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]])
    faces = [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]]
    return holdfast.SignedDistance((corners, np.array(faces)))


def test_penetration_energy(ball, random):
    points = 0.03 * random.standard_normal((40, 3))
    depth = np.maximum(0, (0.05 - np.abs(points).sum(1)) / np.sqrt(3) - 0.002)
    assert (depth > 0).any() and (depth == 0).any()
    energy, gradient = holdfast.penetration_energy(points, ball, 0.002)
    assert energy == pytest.approx((depth**2).sum(), rel=1e-9)
    expected = differences(lambda p: holdfast.penetration_energy(p, ball, 0.002)[0], points)
    np.testing.assert_allclose(gradient, expected, atol=1e-7)
    assert holdfast.penetration_energy(np.zeros((0, 3)), ball)[0] == 0.0


def test_no_points(pairs):
    _, object, _ = pairs
    for term in (holdfast.distance_energy, holdfast.contact_energy):
        energy, grad_hand, grad_object = term(np.zeros((0, 3)), object, np.zeros((0, 19)))
        assert energy == 0.0 and grad_hand.shape == (0, 3) and not grad_object.any()
        assert grad_object.shape == object.shape


@pytest.mark.parametrize("term", [holdfast.distance_energy, holdfast.contact_energy])
def test_wrong_shapes_are_said(term, pairs):
    hand, object, reference = pairs
    refused(ValueError, r"reference: expected .* \(11, 19\), got \(19, 11\)", term, hand, object, reference.T)
    refused(ValueError, "hand: expected", term, hand[:, :2], object, reference)
    refused(ValueError, r"object\[0, 0\] is NaN", term, hand, np.full_like(object, np.nan), reference)
    refused(TypeError, "hand: expected", term, "hand", object, reference)


def test_numbers_out_of_range_are_said(pairs, ball):
    hand, object, reference = pairs
    refused(ValueError, "threshold_m", holdfast.contact_energy, hand, object, reference, 0.0)
    refused(ValueError, "give_m", holdfast.penetration_energy, hand, ball, -1.0)
    refused(TypeError, "signed_distance", holdfast.penetration_energy, hand, 3)
    refused(ValueError, "threads", holdfast.distance_energy, hand, object, reference, threads=-1)
