#!/usr/bin/python3
"""fairing_node: a noisy sphere, a sphere with a hole, meshes and options that are refused."""
import math
import random

import rospy
from geometry_msgs.msg import Point
from slender_sim.srv import FairMesh, FairMeshRequest

from node_harness import NodeCase, run


def icosphere(subdivisions):
    """Vertices on the unit sphere and triangles."""
    g = 0.5 * (1.0 + math.sqrt(5.0))
    vertices = [(-1, g, 0), (1, g, 0), (-1, -g, 0), (1, -g, 0), (0, -1, g), (0, 1, g), (0, -1, -g), (0, 1, -g), (g, 0, -1), (g, 0, 1), (-g, 0, -1), (-g, 0, 1)]
    triangles = [(0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11), (1, 5, 9), (5, 11, 4), (11, 10, 2), (10, 7, 6), (7, 1, 8),
                 (3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8), (3, 8, 9), (4, 9, 5), (2, 4, 11), (6, 2, 10), (8, 6, 7), (9, 8, 1)]
    vertices = [unit(v) for v in vertices]
    for _ in range(subdivisions):
        middles, finer = {}, []

        def middle(a, b):
            key = (min(a, b), max(a, b))
            if key not in middles:
                vertices.append(unit([p + q for p, q in zip(vertices[a], vertices[b])]))
                middles[key] = len(vertices) - 1
            return middles[key]

        for a, b, c in triangles:
            d, e, f = middle(a, b), middle(b, c), middle(c, a)
            finer += [(a, d, f), (b, e, d), (c, f, e), (d, e, f)]
        triangles = finer
    return vertices, triangles


def unit(v):
    size = math.sqrt(sum(c * c for c in v))
    return tuple(c / size for c in v)


def without(vertices, triangles, dropped):
    """The mesh without triangles that have a vertex to be dropped, and without vertices that no triangle has."""
    kept = [t for t in triangles if not any(dropped(vertices[v]) for v in t)]
    used = sorted(set(v for t in kept for v in t))
    number = {v: k for k, v in enumerate(used)}
    return [vertices[v] for v in used], [tuple(number[v] for v in t) for t in kept]


def request(vertices, triangles, **options):
    return FairMeshRequest(vertices=[Point(*v) for v in vertices], triangles=[v for t in triangles for v in t], **options)


def radii(points):
    return [math.sqrt(p.x ** 2 + p.y ** 2 + p.z ** 2) for p in points]


class Fairing(NodeCase):

    def setUp(self):
        NodeCase.setUp(self)
        self.launch("fairing_node", "fairing", {})
        rospy.wait_for_service("/t/fairing/fair_mesh", 60)
        self.fair = rospy.ServiceProxy("/t/fairing/fair_mesh", FairMesh)

    def test_smooths_a_noisy_sphere(self):
        vertices, triangles = icosphere(3)
        dice = random.Random(4)
        rough = []
        for v in vertices:
            factor = 1.0 + dice.uniform(-0.02, 0.02)
            rough.append(tuple(factor * c for c in v))
        before = radii([Point(*v) for v in rough])
        answer = self.fair(request(rough, triangles, steps=10, smoothing=0.3))
        self.assertTrue(answer.success, answer.message)
        self.assertEqual(answer.message, "")
        self.assertEqual(len(answer.vertices), len(vertices))
        self.assertEqual(list(answer.triangles), [v for t in triangles for v in t])
        centre = [sum(getattr(p, c) for p in answer.vertices) / len(vertices) for c in "xyz"]
        after = [math.dist((p.x, p.y, p.z), centre) for p in answer.vertices]
        mean = sum(after) / len(after)
        rms = math.sqrt(sum((r - mean) ** 2 for r in after) / len(after))
        rospy.loginfo("radius errors: largest %g, root mean square %g", max(abs(r - mean) for r in after), rms)
        self.assertGreater(max(before) - min(before), 0.03)
        self.assertLess(rms, 0.002)                                  # was 0.012
        self.assertLess(max(abs(r - mean) for r in after), 0.005)    # without noise this mesh ends with 0.0017, at vertices of five edges
        self.assertAlmostEqual(mean, 1.0, delta=0.02)
        self.assertLess(answer.energy, answer.energy_before)
        self.assertAlmostEqual(answer.energy, 8 * math.pi, delta=0.03 * 8 * math.pi)
        self.assertGreater(answer.steps, 0)

    def test_fills_a_hole(self):
        vertices, triangles = without(*icosphere(4), dropped=lambda v: v[2] > math.cos(math.pi / 4))
        answer = self.fair(request(vertices, triangles, fill_holes=True))
        self.assertTrue(answer.success, answer.message)
        self.assertEqual((answer.holes_closed, answer.holes_open, answer.steps), (1, 0, 0))
        self.assertGreater(len(answer.vertices), len(vertices) + 100)
        for v, p in zip(vertices, answer.vertices):
            self.assertEqual(v, (p.x, p.y, p.z))
        error = max(abs(r - 1.0) for r in radii(answer.vertices))
        rospy.loginfo("largest radius error of the patch %g", error)
        self.assertLess(error, 0.005)
        edges = {}
        for k in range(0, len(answer.triangles), 3):
            t = answer.triangles[k:k + 3]
            for a, b in ((0, 1), (1, 2), (2, 0)):
                edges[(t[a], t[b])] = edges.get((t[a], t[b]), 0) + 1
        self.assertTrue(all(n == 1 and (b, a) in edges for (a, b), n in edges.items()))       # closed, one way round
        answer = self.fair(request(vertices, triangles, fill_holes=True, largest_hole=5))
        self.assertEqual((answer.holes_closed, answer.holes_open), (0, 1))

    def test_only_the_region_moves(self):
        vertices, triangles = icosphere(2)
        rough = [tuple((1.0 + 0.01 * (k % 3)) * c for c in v) for k, v in enumerate(vertices)]
        answer = self.fair(request(rough, triangles, steps=3, region_centers=[Point(0, 0, 1)], region_radii=[0.7]))
        self.assertTrue(answer.success, answer.message)
        moved = [v != (p.x, p.y, p.z) for v, p in zip(rough, answer.vertices)]
        near = [math.dist(v, (0, 0, 1)) <= 0.7 for v in rough]
        self.assertTrue(any(moved))
        self.assertTrue(all(n for m, n in zip(moved, near) if m))

    def refused(self, words, vertices, triangles, **options):
        options.setdefault("steps", 1)
        answer = self.fair(request(vertices, triangles, **options))
        self.assertFalse(answer.success)
        self.assertEqual(len(answer.vertices), 0)
        for word in words:
            self.assertIn(word, answer.message)

    def test_bad_meshes_are_refused_by_name(self):
        square = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
        two = [(0, 1, 2), (0, 2, 3)]
        self.refused(["face 2", "no area"], square + [(2, 0, 0)], two + [(0, 1, 4)])
        self.refused(["edge between vertices 0 and 2", "0, 1 and 2"], square + [(0.5, 0.5, 1)], two + [(0, 2, 4)])
        self.refused(["vertices 2 and 4", "same place"], square + [(1, 1, 0)], [(0, 1, 2), (0, 4, 3)])
        self.refused(["vertex 1", "finite"], [square[0], (float("nan"), 0, 0)] + square[2:], two)
        self.refused(["triangle 1", "vertex 7"], square, [(0, 1, 2), (0, 2, 7)])
        self.refused(["no face"], square + [(5, 5, 5)], two)
        self.refused(["no faces"], square, [])
        self.refused(["no faces"], [], [])
        odd = request(square, two, steps=1)
        odd.triangles = odd.triangles[:5]
        self.assertIn("5 numbers", self.fair(odd).message)

    def test_bad_options_are_refused(self):
        vertices, triangles = icosphere(1)
        self.refused(["nothing to do"], vertices, triangles, steps=0)
        self.refused(["largest hole", "4000000000"], vertices, triangles, fill_holes=True, largest_hole=4000000000)
        self.refused(["steps", "4000000000"], vertices, triangles, steps=4000000000)
        self.refused(["smoothing"], vertices, triangles, smoothing=-1)
        for absurd in (1e-200, 1e-9, 1e9, 1e200):
            self.refused(["smoothing length", "mean edge"], vertices, triangles, smoothing=absurd)
        self.refused(["edge length"], vertices, triangles, fill_holes=True, edge_length=float("inf"))
        open_box = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], [(0, 2, 1), (0, 1, 3), (0, 3, 2)]
        self.refused(["1000000 faces", "longer than"], *open_box, steps=0, fill_holes=True, edge_length=1e-6)
        self.refused(["1 centers and 0 radii"], vertices, triangles, region_centers=[Point()])
        self.refused(["radius"], vertices, triangles, region_centers=[Point()], region_radii=[-1])
        self.refused(["no vertex may move"], vertices, triangles, region_centers=[Point(9, 9, 9)], region_radii=[1])
        self.assertTrue(self.fair(request(vertices, triangles, steps=1)).success)             # it goes on


if __name__ == "__main__":
    run("fairing_test", Fairing)
