#!/usr/bin/python3
"""tracking_node with rods that track a guide curve: by points, live against offline, refused points, restart; who simulates what."""
import csv
import math
import struct
import subprocess

import rospy
from sensor_msgs.msg import PointCloud2, PointField
from slender_sim.msg import RodState
from slender_sim.srv import FilePath, SetGrasp, SetGraspRequest
from std_srvs.srv import Trigger
from visualization_msgs.msg import MarkerArray

from node_harness import NodeCase, find_program, run, wait_until

RATE = 25.0
SCENE = """
name: rope
time: {step: 0.01, duration: 1}
rods:
  - name: rope
    centerline: {straight: {from: [0, 0, 1], to: [1, 0, 1], edges: 40}}
    damping: {mass: 0.5}
    grasps: {end: {edges: [0]}}
    track: {guide: {nodes: 5, motion: %s}}
"""
FREE = "  - {name: free, centerline: {straight: {from: [0, 1, 1], to: [1, 1, 1], edges: 10}}}\n"
REST = [(0.25 * k, 0.0, 1.0) for k in range(5)]


def wave(t):
    """The guide at rest until 0.1 s, then waving."""
    s = min(max((t - 0.1) / 0.3, 0.0), 1.0)
    return [(x, 0.02 * s * math.sin(7 * t) * x, z + 0.08 * s * math.sin(9 * t + 4 * x) * x) for x, _, z in REST]


def cloud(points, stamp):
    message = PointCloud2()
    message.header.stamp = rospy.Time.from_sec(stamp)
    message.header.frame_id = "world"
    message.fields = [PointField(n, 8 * k, PointField.FLOAT64, 1) for k, n in enumerate("xyz")]
    message.height, message.width, message.point_step, message.row_step = 1, len(points), 24, 24 * len(points)
    message.data = b"".join(struct.pack("<3d", *p) for p in points)
    return message


def xyz(points):
    return [(p.x, p.y, p.z) for p in points]


def distance(a, b):
    return max(math.dist(p, q) for p, q in zip(a, b))


class TrackedRods(NodeCase):

    def begin(self, scene=SCENE % "{topic: points}"):
        self.start(scene, program="tracking_node")
        self.states = self.listen("/t/state", RodState)

    def after(self, n):
        return self.states_after(self.states, n)

    def send(self, guide, frames):
        """All of them have arrived when this returns."""
        before = int(self.diagnostics("inputs")["received"])
        for time, points in frames:
            guide.publish(cloud(points, time))
        wait_until(lambda: int(self.diagnostics("inputs")["received"]) >= before + len(frames), what="the guide's messages")

    def send_wave(self, guide):
        self.send(guide, [(1.0 + k / RATE, wave(k / RATE)) for k in range(int(RATE) + 1)])

    def test_points_live_equal_offline(self):
        self.begin()
        guide = self.publisher("/t/guide/points", PointCloud2)
        self.send_wave(guide)
        live = {}
        for k in range(1, 81):
            state = self.after(1)
            live[k] = state
            self.assertEqual((len(state.constraint_errors), len(state.guide_nodes), len(state.guide_forces)), (5, 5, 5))
            self.assertLess(max(state.constraint_errors), 1e-12)
        with open(self.path("guide.csv"), "w") as file:
            for k in range(int(RATE) + 1):
                file.write(",".join("%.17g" % v for v in [k / RATE] + [c for p in wave(k / RATE) for c in p]) + "\n")
        with open(self.path("offline.yaml"), "w") as file:
            file.write(SCENE % "{file: guide.csv}")
        done = subprocess.run([find_program("simulate"), self.path("offline.yaml"), "--duration", "0.8", "--csv", self.path("csv"), "--bag", self.path("run.bag"), "--quiet"])
        self.assertEqual(done.returncode, 0)
        offline = {}
        with open(self.path("csv/nodes.csv")) as file:
            for row in csv.DictReader(file):
                offline.setdefault(round(float(row["t [s]"]) / 0.01), []).append(tuple(float(row[c + " [m]"]) for c in "xyz"))
        for k, state in live.items():
            self.assertLess(distance(xyz(state.nodes), offline[k]), 1e-6, "step %d" % k)   # stamps are whole nanoseconds
        self.assertGreater(distance(xyz(live[80].nodes), offline[0]), 0.03)
        self.assertLess(distance(xyz(live[20].guide_nodes), wave(0.2)), 1e-6)
        self.assertGreater(sum(f.z for f in live[80].guide_forces), 0.0)
        # a bag has what tracking.csv has
        done = subprocess.run([find_program("bag_to_csv"), self.path("run.bag"), "--out", self.path("again"), "--scene-dir", self.folder])
        self.assertEqual(done.returncode, 0)
        with open(self.path("csv/tracking.csv")) as file, open(self.path("again/tracking.csv")) as other:
            rows = file.read()
            self.assertEqual(rows, other.read())
        self.assertEqual(rows.count("\n"), 1 + 5 * 81)
        self.assertIn(",rope,node 4,", rows)

    def test_bad_points_are_dropped_and_the_guide_is_held(self):
        self.begin()
        guide = self.publisher("/t/guide/points", PointCloud2)
        self.after(1)
        bad = list(REST)
        bad[3] = (0.0, float("nan"), 0.0)
        self.send(guide, [(1.02, REST[:4]), (1.02, REST + REST[:1]), (1.02, bad)])
        self.assertEqual((self.dropped("wrong_length"), self.dropped("not_finite")), (2, 1))
        self.assertIn("6 points, but the guide has 5 nodes", self.diagnostics("inputs")["last dropped wrong_length"])
        self.assertLess(distance(xyz(self.after(10).guide_nodes), REST), 1e-12)
        up = [(x, y, z + 0.05) for x, y, z in REST]
        self.send(guide, [(1.15, up)])
        state = self.after(60)   # it catches up, and stays where the last message had it
        self.assertLess(distance(xyz(state.guide_nodes), up), 1e-9)
        self.assertLess(max(state.constraint_errors), 1e-12)

    def test_restart_and_what_is_shown(self):
        self.begin(SCENE % "{topic: points}" + FREE)
        markers = self.listen("/t/markers", MarkerArray)
        guide = self.publisher("/t/guide/points", PointCloud2)
        self.send_wave(guide)
        self.after(40)
        self.assertTrue(self.call("save_state", FilePath, self.path("state")).success)
        self.after(20)
        self.assertTrue(self.call("load_state", FilePath, self.path("state")).success)
        self.after(1)
        self.assertTrue(self.call("set_grasp", SetGrasp, SetGraspRequest(name="end", action=SetGraspRequest.RELEASE)).success)
        refused = self.call("set_grasp", SetGrasp, SetGraspRequest(name="end", action=SetGraspRequest.ATTACH_NODES, first_node=0, last_node=40))
        self.assertFalse(refused.success)
        self.assertIn("test function", refused.message)
        self.assertTrue(self.call("reset", Trigger).success)
        states = {s.name: s for s in self.states.all_at(self.step(5).stamp, 2)}
        self.assertLess(distance(xyz(states["rope"].guide_nodes), REST), 1e-12)   # forgets what was sent
        self.assertEqual((len(states["free"].guide_nodes), len(states["free"].constraint_errors), len(states["free"].guide_forces)), (0, 0, 0))
        wait_until(lambda: markers.count() > 0, what="markers")
        drawn = {(m.ns, m.id): m for m in markers.last().markers}
        self.assertEqual(len(drawn[("guides/rope", 0)].points), 5)
        values = self.diagnostics("simulation")
        self.assertLess(float(values["worst constraint residual over size"]), 1e-10)
        self.assertGreater(float(values["largest guide force [N]"]), 0.0)


if __name__ == "__main__":
    run("tracked_rods_test", TrackedRods)
