#!/usr/bin/python3
"""cloth_node: a sphere that `bodies` messages move pushes a cloth, and nothing passes through anything."""
import math

import rospy
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import WrenchStamped
from slender_sim.msg import BodyStates, ClothState, MeshStamped
from slender_sim.srv import FilePath
from visualization_msgs.msg import MarkerArray

from node_harness import NodeCase, fill, pose, run, status_of, wait_until

STEP = 0.01
RADIUS = 0.06
SCENE = """
name: push
time: {step: 0.01, duration: 1}
cloths:
  - name: sheet
    grid: {corner: [-0.2, 0, 0.6], sides: [[0.4, 0, 0], [0, 0, 0.4]], cells: 10, pattern: alternating}
    material: {area_density: 0.2, thickness: 0.0005, youngs_modulus: 5.0e5}
    damping: {mass: 2, stiffness: 0.002}
    contact: {friction: 0.2, thickness: 0.004}
    grasps:
      top: {edge: upper}
bodies:
  - {name: ball, shape: {sphere: {radius: 0.06}}, pose: {position: [0, -0.2, 0.7]}, motion: {topic: true}}
"""


def minus(a, b):
    return [p - q for p, q in zip(a, b)]


def dot(a, b):
    return sum(p * q for p, q in zip(a, b))


def distance(p, a, b, c):
    """Of a point and a triangle, by its sides and, where the point is above the inside, its plane."""
    least = float("inf")
    for s, t in ((a, b), (b, c), (c, a)):
        along, way = minus(t, s), minus(p, s)
        share = min(1.0, max(0.0, dot(way, along) / dot(along, along)))
        least = min(least, math.dist(p, [q + share * d for q, d in zip(s, along)]))
    u, v, w = minus(b, a), minus(c, a), minus(p, a)
    uu, uv, vv, uw, vw = dot(u, u), dot(u, v), dot(v, v), dot(u, w), dot(v, w)
    area = uu * vv - uv * uv
    s, t = (vv * uw - uv * vw) / area, (uu * vw - uv * uw) / area
    if s >= 0 and t >= 0 and s + t <= 1:
        least = min(least, math.dist(p, [q + s * d + t * e for q, d, e in zip(a, u, v)]))
    return least


class ClothContact(NodeCase):

    def send(self, publisher, y, k):
        message = BodyStates()
        message.header.frame_id = "world"
        message.header.stamp = rospy.Time.from_sec(1.0 + STEP * k)
        message.name = ["ball"]
        message.pose = [fill(pose(0, 0, 0).pose, (0.0, y, 0.7))]
        publisher.publish(message)

    def test_a_moving_sphere_pushes_it(self):
        self.start(SCENE, program="cloth_node")
        states = self.listen("/t/state", ClothState)
        told = self.listen("/t/body_states", BodyStates)
        wrench = self.listen("/t/grasps/top/wrench", WrenchStamped)
        markers = self.listen("/t/markers", MarkerArray)
        balls = self.publisher("/t/bodies", BodyStates)
        corners = rospy.wait_for_message("/t/mesh", MeshStamped, 60).triangles
        for k in range(2, 82):           # 0.35 m in 0.8 s, through where the cloth hangs
            self.send(balls, -0.2 + 0.35 * (k - 1) / 80.0, k)
        self.arrived()
        ball, touched = {}, 0
        for _ in range(100):
            state = self.states_after(states, 1)
            bodies = told.at(state.header.stamp)
            centre = bodies.pose[bodies.name.index("ball")].position
            ball = (centre.x, centre.y, centre.z)
            points = [(v.x, v.y, v.z) for v in state.vertices]
            near = min(distance(ball, *[points[corners[3 * f + c]] for c in range(3)]) for f in range(len(corners) // 3))
            self.assertGreater(near, RADIUS)
            touched += near < RADIUS + 0.004
        self.assertAlmostEqual(ball[1], 0.15, delta=0.35 / 80)
        self.assertGreater(touched, 20)
        in_front = [p for p in points if math.hypot(p[0], p[2] - 0.7) < 0.03]
        self.assertGreater(len(in_front), 0)
        for p in in_front:
            self.assertGreater(p[1], ball[1] + 0.9 * math.sqrt(RADIUS ** 2 - 0.03 ** 2))
        self.assertGreater(wrench.at(state.header.stamp).wrench.force.y, 0.02)
        reports = self.listen("/diagnostics", DiagnosticArray)   # each counts since the one before it
        self.step(10)
        wait_until(lambda: any(float(status_of(report, "simulation")["contacts per step"]) > 0
                               for report in reports.all()), what="contacts in the diagnostics")
        wait_until(lambda: markers.count() > 0, what="markers")
        drawn = {m.ns: m for m in markers.last().markers}
        self.assertAlmostEqual(drawn["bodies"].scale.x, 2 * RADIUS)

    def test_restart_in_contact(self):
        moving = SCENE.replace("pose: {position: [0, -0.2, 0.7]}, motion: {topic: true}", "motion: {table: [[0, 0, -0.2, 0.7], [0.5, 0, 0.1, 0.7]]}")
        self.start(moving, program="cloth_node")
        states = self.listen("/t/state", ClothState)
        self.states_after(states, 35)
        self.assertTrue(self.call("save_state", FilePath, self.path("state")).success)
        numbers = lambda s: [c for p in list(s.vertices) + list(s.velocities) for c in (p.x, p.y, p.z)]
        later = [numbers(self.states_after(states, 1)) for _ in range(10)]
        self.assertTrue(self.call("load_state", FilePath, self.path("state")).success)
        self.assertEqual([numbers(self.states_after(states, 1)) for _ in range(10)], later)

    def test_intersections_at_the_start_are_refused(self):
        process = self.start(SCENE.replace("[0, -0.2, 0.7]", "[0, -0.05, 0.7]"), wait=False, program="cloth_node")
        self.assertEqual(process.wait(60), 2)
        for word in ("cloth 'sheet' at vertex", "meets 'ball'", "move them apart"):
            self.assertIn(word, self.output("rod.err"))


if __name__ == "__main__":
    run("cloth_contact_test", ClothContact)
