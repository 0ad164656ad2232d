#!/usr/bin/python3
"""A knot from its launch file: it comes to rest, still knotted, and the wire never enters itself."""
import math
import unittest

from node_harness import Listener, run, wait_until
from slender_sim.msg import RodState

STEP = 0.004
RADIUS = 0.002


def minus(a, b):
    return tuple(x - y for x, y in zip(a, b))


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def points_of(state):
    return [(p.x, p.y, p.z) for p in state.nodes]


def writhe(points):
    """Gauss's double sum; a straight wire has none, an overhand knot about three."""
    edges = [(a, minus(b, a)) for a, b in zip(points, points[1:])]
    total = 0.0
    for i, (a, d) in enumerate(edges):
        for b, e in edges[:i]:
            r = minus(tuple(x + 0.5 * y for x, y in zip(a, d)), tuple(x + 0.5 * y for x, y in zip(b, e)))
            total += dot(r, cross(d, e)) / (2 * math.pi * dot(r, r) ** 1.5)
    return total


def own_distance(points, apart=12):
    """Smallest distance of nodes to edges at least `apart` edges away: never less than that of the curve to itself."""
    least = math.inf
    for i, p in enumerate(points):
        for j, (a, b) in enumerate(zip(points, points[1:])):
            if i - j < apart and j - i < apart:
                continue
            d = minus(b, a)
            s = min(1.0, max(0.0, dot(minus(p, a), d) / dot(d, d)))
            least = min(least, math.dist(p, tuple(x + s * y for x, y in zip(a, d))))
    return least


class Knot(unittest.TestCase):

    def test_the_knot_holds(self):
        states = Listener("state", RodState)
        wait_until(lambda: states.last().step * STEP > 2.0, 400, "two seconds of the knot")
        last = states.last()
        self.assertGreater(abs(writhe(points_of(last))), 2.0)
        seen = states.all()
        for state in seen[::max(1, len(seen) // 20)] + [last]:
            distance = own_distance(points_of(state))
            self.assertGreater(distance, 2 * RADIUS, "step %d" % state.step)
        self.assertLess(own_distance(points_of(last)), 2.3 * RADIUS)    # strands touch
        self.assertLess(max(math.sqrt(v.x ** 2 + v.y ** 2 + v.z ** 2) for v in last.velocities), 0.02)


if __name__ == "__main__":
    run("knot_test", Knot)
