"""Iterations that are helped on their way, beside plain turns."""

import numpy as np

from scenes.baking.secant import Secant

SHARE = 0.6
GIVEN = [np.array([1.0, 2.0, 3.0]), np.array([[4.0], [5.0]])]


def turned(fields):
    """A turn that adds a share of what it is begun with, mixed a little: x = given + SHARE x + 0.02 mean(x)."""
    mean = np.concatenate([field.ravel() for field in fields]).mean()
    return [given + SHARE * field + 0.02 * mean for given, field in zip(GIVEN, fields, strict=True)]


def turns_until(helped):
    fields, secant = [np.zeros(3), np.zeros((2, 1))], Secant()
    for number in range(1, 100):
        made = turned(fields)
        if max(np.abs(m - f).max() for m, f in zip(made, fields, strict=True)) < 1e-6:
            return number, made
        fields = secant.following(fields, made) if helped else made
    raise AssertionError("not settled")


def test_the_same_is_found_in_a_third_of_the_turns():
    number, found = turns_until(helped=True)
    plain, expected = turns_until(helped=False)
    assert number <= plain / 3
    for a, b in zip(found, expected, strict=True):
        np.testing.assert_allclose(a, b, rtol=1e-5)


def test_what_does_not_change_any_more_is_left_as_it_is():
    secant, still = Secant(), [np.ones(3)]
    for _ in range(3):
        np.testing.assert_array_equal(secant.following(still, still)[0], still[0])
