#!/usr/bin/python3
"""tracking_node: guides by points and by bodies, refused and late ones, live against offline, restart, markers."""
import csv
import math
import os
import struct
import subprocess

import rosbag
import rospy
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import Pose, PoseStamped
from sensor_msgs.msg import PointCloud2, PointField
from slender_sim.msg import BodyStates, ClothState, MeshStamped
from slender_sim.srv import FilePath, SetFunctions
from std_srvs.srv import Trigger
from visualization_msgs.msg import MarkerArray

from node_harness import NodeCase, fill, find_program, run, status_of, wait_until

STEP = 0.01
RATE = 25.0
SCENE = """
name: flap
time: {step: 0.01, duration: 1}
tracked:
  - name: flap
    guide:
      mesh: {file: %s}
      motion: %s
    mesh: {subdivide: 2}
    material: {area_density: 0.2, thickness: 0.0005, youngs_modulus: 2.0e5}
    bending: {model: hinge}
    damping: {stiffness: 0.002}
    solver: {one_newton_step: true}
"""
PREVIEW = """
name: preview
time: {step: 0.01, duration: 2}
cloths:
  - name: preview
    grid: {corner: [0, 0, 0.5], sides: [[0.4, 0, 0], [0, 0.4, 0]], cells: [2, 2], pattern: alternating}
    material: {area_density: 0.2, thickness: 0.0005, youngs_modulus: 2.0e5}
    damping: {mass: 2, stiffness: 0.002}
    solver: {one_newton_step: true}
    grasps: {hand: {corner: lower_left, motion: {topic: true}}}
tracked:
  - name: fine
    guide: {cloth: preview}
    mesh: {subdivide: 2}
    material: {area_density: 0.2, thickness: 0.0005, youngs_modulus: 2.0e5}
    damping: {mass: 2, stiffness: 0.002}
    solver: {one_newton_step: true}
"""
REST = [(0.2 * i, 0.2 * j, 0.5) for j in range(3) for i in range(3)]
FACES = [(1, 2, 5), (1, 5, 4), (2, 3, 6), (2, 6, 5), (4, 5, 8), (4, 8, 7), (5, 6, 9), (5, 9, 8)]


def obj(points):
    return "".join("v %.17g %.17g %.17g\n" % p for p in points) + "".join("f %d %d %d\n" % f for f in FACES)


def wave(t):
    """The guide at rest until 0.1 s, then waving."""
    s = min(max((t - 0.1) / 0.2, 0.0), 1.0)
    return [(x + 0.02 * s * math.sin(7 * t), y, z + 0.06 * s * math.sin(9 * t + 4 * x)) for x, y, z in REST]


def cloud(points, stamp, kind=PointField.FLOAT64, frame="world"):
    message = PointCloud2()
    message.header.stamp = rospy.Time.from_sec(stamp)
    message.header.frame_id = frame
    size = 8 if kind == PointField.FLOAT64 else 4
    message.fields = [PointField(n, k * size, kind, 1) for k, n in enumerate("xyz")]
    message.height, message.width, message.point_step = 1, len(points), 3 * size
    message.row_step = 3 * size * len(points)
    message.data = b"".join(struct.pack("<3d" if size == 8 else "<3f", *p) for p in points)
    return message


def bodies(poses, stamp):
    message = BodyStates()
    message.header.stamp = rospy.Time.from_sec(stamp)
    message.header.frame_id = "world"
    for name, (p, q) in poses:
        message.name.append(name)
        message.pose.append(fill(Pose(), p, q))
    return message


def vertices(points):
    return [(p.x, p.y, p.z) for p in points]


def distance(a, b):
    return max(math.dist(p, q) for p, q in zip(a, b))


class Tracking(NodeCase):

    def begin(self, motion, more="", **parameters):
        with open(self.path("rest.obj"), "w") as file:
            file.write(obj(REST))
        self.start(SCENE % (self.path("rest.obj"), motion) + more, program="tracking_node", **parameters)
        self.states = self.listen("/t/state", ClothState)

    def after(self, n):
        return self.states_after(self.states, n)

    def send_wave(self, guide, until):
        for k in range(int(until * RATE) + 1):
            guide.publish(cloud(wave(k / RATE), 1.0 + k / RATE))
        self.arrived()

    def test_points_live_equal_offline(self):
        self.begin("{topic: points}")
        guide = self.publisher("/t/guide/points", PointCloud2)
        self.send_wave(guide, 1.0)
        live = {}
        for k in range(1, 81):
            state = self.after(1)
            live[k] = state
            self.assertLess(state.constraint_errors[0], 1e-12)
        for k in range(int(RATE) + 1):
            with open(self.path("frame_%02d.obj" % k), "w") as file:
                file.write(obj(wave(k / RATE)))
        with open(self.path("offline.yaml"), "w") as file:
            file.write(SCENE % ("rest.obj", '{frames: "frame_*.obj", rate: %g}' % RATE))
        done = subprocess.run([find_program("simulate"), self.path("offline.yaml"), "--duration", "0.8", "--csv", self.path("csv"), "--quiet"])
        self.assertEqual(done.returncode, 0)
        offline = {}
        with open(self.path("csv/cloths.csv")) as file:
            for row in csv.DictReader(file):
                offline.setdefault(round(float(row["t [s]"]) / STEP), []).append(tuple(float(row[c + " [m]"]) for c in "xyz"))
        for k, state in live.items():
            self.assertLess(distance(vertices(state.vertices), offline[k]), 1e-6, "step %d" % k)   # stamps are whole nanoseconds
        self.assertGreater(distance(vertices(live[80].vertices), offline[0]), 0.03)
        # between messages the guide is interpolated: at one of them it is there
        self.assertLess(distance(vertices(live[20].guide_vertices), wave(0.2)), 1e-6)
        self.assertEqual(len(live[80].guide_forces), 9)
        self.assertEqual((list(live[80].forces_at_bound), list(live[80].bound_distances)), ([0], [0.0]))
        self.assertGreater(sum(f.z for f in live[80].guide_forces), 0.0)

    def test_forces_are_bounded(self):
        self.begin("{topic: points}", more="    max_traction: 20\n")
        guide = self.publisher("/t/guide/points", PointCloud2)
        for k in range(6):
            guide.publish(cloud([(x * (1 + 0.4 * k), y, z) for x, y, z in REST], 1.0 + k / RATE))
        self.arrived()
        state = self.after(40)
        self.assertGreater(state.forces_at_bound[0], 2)
        self.assertGreater(state.bound_distances[0], 0.05)
        self.assertLess(state.constraint_errors[0], 1e-12)
        total = sum(math.sqrt(f.x ** 2 + f.y ** 2 + f.z ** 2) for f in state.guide_forces)
        self.assertLess(total, 20 * 0.16 * (1 + 1e-9))
        reports = self.listen("/diagnostics", DiagnosticArray)   # each tells of the steps since the one before it
        self.step(10)

        def told():
            return [status for status in (status_of(report, "simulation") for report in reports.all())
                    if int(status["most guide forces at their bounds"]) > 2]
        wait_until(told, what="guide forces at their bounds in the diagnostics")
        self.assertGreater(float(told()[0]["greatest distance where forces are at their bounds [m]"]), 0.05)

    def test_functions_are_switched(self):
        self.begin("{topic: points}", more="    test_functions: [{name: loose, regions: {all: {guide: [0..8]}}}, {name: tight, basis: subdivision, blend: 0.4}]\n")
        guide = self.publisher("/t/guide/points", PointCloud2)
        self.send_wave(guide, 1.0)
        before = self.after(30)
        self.assertEqual((list(before.function_sets), len(before.guide_forces), before.blend_distances[0]), (["loose"], 1, 0.0))
        call = lambda *request: self.call("set_functions", SetFunctions, *request)
        self.assertIn('"firm"; cloth flap has: loose tight', call("", "firm", 0.1).message)
        self.assertIn('no tracked cloth "flag"; the scene has: flap', call("flag", "tight", 0.1).message)
        self.assertIn("0 or more", call("flap", "tight", float("nan")).message)
        self.assertEqual(self.after(1).function_sets[0], "loose")
        answer = call("", "tight", 0.2)
        self.assertTrue(answer.success, answer.message)
        states = [self.after(1) for _ in range(25)]
        self.assertEqual({(s.function_sets[0], len(s.guide_forces)) for s in states}, {("tight", 9)})
        self.assertGreater(states[2].blend_distances[0], 1e-3)
        self.assertEqual([s.blend_distances[0] > 0 for s in states], [True] * 19 + [False] * 6)
        self.assertLess(max(s.constraint_errors[0] for s in states), 1e-12)
        steps = [distance(vertices(b.vertices), vertices(a.vertices)) for a, b in zip([before] + states, states)]
        self.assertLess(max(steps[2:]), 0.03)
        self.assertTrue(call("flap", "loose", -1).success)
        state = self.after(1)
        self.assertGreater(state.blend_distances[0], 0.0)   # 0.2 s as the scene has it by default
        values = self.diagnostics("simulation")
        self.assertEqual(values["test functions of flap"], "loose")
        self.assertGreater(float(values["blend of flap goes on for [s]"]), 0.15)
        self.assertEqual(self.after(20).blend_distances[0], 0.0)
        self.assertTrue(self.call("reset", Trigger).success)
        self.assertEqual(self.after(1).function_sets[0], "loose")

    def test_bodies(self):
        self.begin("{topic: bodies, groups: {left: [0, 3, 6, 1, 4, 7], right: [2, 5, 8, 1, 4, 7]}}")
        guide = self.publisher("/t/guide/bodies", BodyStates)
        start = self.after(1)
        for k in range(26):
            t = k / RATE
            lift = 0.1 * (3 * t ** 2 - 2 * t ** 3)
            q = (0, 0, 0, 1)
            guide.publish(bodies([("left", ((5, 5, 5), q)), ("right", ((7, 0, lift), q))], 1.0 + 0.01 + t))
        self.arrived()
        state = self.after(105)
        moved = [q[2] - p[2] for p, q in zip(REST, vertices(state.guide_vertices))]
        for i, up in enumerate(moved):   # the offset at the first message stays; the middle column is shared
            self.assertAlmostEqual(up, (0.0, 0.05, 0.1)[i % 3], delta=1e-9)
        self.assertLess(state.constraint_errors[0], 1e-12)
        self.assertLess(distance(vertices(start.guide_vertices), REST), 1e-12)
        inputs = self.diagnostics("inputs")
        self.assertEqual(inputs["message"], "ok")
        self.assertIn("input age guide/bodies right [s]", inputs)
        guide.publish(bodies([("left", ((0, 0, 0), (0, 0, 0, 3)))], 3.0))
        guide.publish(bodies([("foot", ((0, 0, 0), (0, 0, 0, 1)))], 3.0))
        self.expect_drop("bad_quaternion")
        self.expect_drop("unknown_name")
        inputs = self.diagnostics("inputs")
        self.assertIn("left", inputs["last dropped bad_quaternion"])
        self.assertIn('"foot"', inputs["last dropped unknown_name"])

    def test_a_body_that_never_speaks_is_named(self):
        self.begin("{topic: bodies, groups: {left: [0, 3, 6, 1, 4, 7], right: [2, 5, 8]}}")
        guide = self.publisher("/t/guide/bodies", BodyStates)
        self.after(1)
        self.assertEqual(self.diagnostics("inputs")["message"], "ok")
        guide.publish(bodies([("left", ((0, 0, 0), (0, 0, 0, 1)))], 1.02))
        wait_until(lambda: self.diagnostics("inputs")["message"] == "no input yet for guide/bodies right", what="a warning")
        self.assertEqual(self.diagnostics("inputs")["input age guide/bodies right [s]"], "none yet")

    def test_a_guide_that_never_speaks_is_named(self):
        self.begin("{topic: points}", guide_timeout=0.3)
        never = "no input yet for guide/points"
        for message in ("ok", never, never):
            self.assertEqual(self.diagnostics("inputs")["message"], message)
            self.after(35)
        self.assertTrue(self.call("reset", Trigger).success)
        wait_until(lambda: self.diagnostics("inputs")["message"] == "ok", what="it to count anew after a reset")
        self.after(35)
        wait_until(lambda: self.diagnostics("inputs")["message"] == never, what="the warning")
        self.publisher("/t/guide/points", PointCloud2).publish(cloud(REST, 2.42))
        wait_until(lambda: self.diagnostics("inputs")["message"] == "ok", what="it to be heard")

    def test_a_stamp_far_ahead_does_not_deafen(self):
        self.begin("{topic: points}", guide_ahead=5.0)
        guide = self.publisher("/t/guide/points", PointCloud2)
        self.after(1)
        guide.publish(cloud(REST, 8.0))
        self.expect_drop("from_future")
        self.assertIn("~guide_ahead", self.diagnostics("inputs")["last dropped from_future"])
        guide.publish(cloud([(x, y, z + 0.1) for x, y, z in REST], 1.02))
        guide.publish(cloud([(x, y, z + 0.1) for x, y, z in REST], 4.0))
        self.arrived()
        self.assertAlmostEqual(self.after(200).guide_vertices[0].z, 0.6, delta=1e-6)

    def cloths(self, scene, *arguments):
        """Vertices by step of all cloths of a scene that `simulate` ran."""
        folder = self.path("csv_" + os.path.basename(scene))
        done = subprocess.run([find_program("simulate"), scene, "--duration", "0.8", "--csv", folder, "--quiet"] + list(arguments))
        self.assertEqual(done.returncode, 0)
        steps = {}
        with open(folder + "/cloths.csv") as file:
            for row in csv.DictReader(file):
                steps.setdefault((row["object"], round(float(row["t [s]"]) / STEP)), []).append(tuple(float(row[c + " [m]"]) for c in "xyz"))
        return steps

    def write_scene(self, name, motion):
        with open(self.path(name), "w") as file:
            file.write(SCENE % (self.path("rest.obj"), motion))
        return self.path(name)

    def test_guide_from_a_bag(self):
        for k in range(int(RATE) + 1):
            with open(self.path("frame_%02d.obj" % k), "w") as file:
                file.write(obj(wave(k / RATE)))
        with rosbag.Bag(self.path("guide.bag"), "w") as bag:
            for k in range(int(RATE) + 1):
                message = cloud(wave(k / RATE), 100.0 + k / RATE)
                bag.write("/some/guide/points", message, message.header.stamp + rospy.Duration(0.02))
            other = bodies([("left", ((0, 0, 0), (0, 0, 0, 1)))], 100.0)
            bag.write("/others", other, other.header.stamp)
        self.begin("{bag: %s}" % self.path("guide.bag"))
        frames = self.cloths(self.write_scene("frames.yaml", '{frames: "frame_*.obj", rate: %g}' % RATE))
        played = self.cloths(self.write_scene("bag.yaml", "{bag: guide.bag}"), "--bag", self.path("run.bag"))
        again = self.cloths(self.write_scene("again.yaml", "{bag: {file: run.bag, topic: /state}}"))
        # Stamps round to nanoseconds. Solutions in single precision round to 1e-7 of a step's motion of about 1 mm.
        rounding = 80 * 1e-7 * 1e-3
        for k in range(1, 81):
            self.assertLess(distance(played[("flap", k)], frames[("flap", k)]), rounding, k)
            self.assertLess(distance(vertices(self.after(1).vertices), frames[("flap", k)]), rounding, k)
            self.assertLess(distance(again[("flap", k)], frames[("flap", k)]), 2e-3, k)   # the guide as it was at every step
        self.assertGreater(distance(played[("flap", 80)], played[("flap", 0)]), 0.03)
        for motion, expected in (("{bag: none.bag}", "none.bag"), ("{bag: {file: guide.bag, topic: /here}}", "on /here; it has: "),
                                 ("{bag: run.bag, groups: {all: [0..8]}}", "slender_sim/BodyStates"), ("{bag: guide.bag, groups: {foot: [0..8]}}", "has no body foot")):
            done = subprocess.run([find_program("simulate"), self.write_scene("bad.yaml", motion)], stderr=subprocess.PIPE, universal_newlines=True)
            self.assertEqual(done.returncode, 2)
            self.assertIn(expected, done.stderr)

    def test_bad_points_are_dropped(self):
        self.begin("{topic: points}")
        guide = self.publisher("/t/guide/points", PointCloud2)
        self.after(1)
        guide.publish(cloud(REST[:8], 1.02))
        guide.publish(cloud(REST + REST[:1], 1.02))
        bad = list(REST)
        bad[3] = (0.0, float("nan"), 0.0)
        guide.publish(cloud(bad, 1.02))
        guide.publish(cloud([(1e9, 0, 0)] * 9, 1.02))
        guide.publish(cloud(REST, 1.02, frame="nowhere"))
        guide.publish(cloud(REST, 1.02, frame=""))
        short = cloud(REST, 1.02)
        short.data = short.data[:-1]
        guide.publish(short)
        flat = cloud(REST, 1.02)
        flat.fields = flat.fields[:2]
        guide.publish(flat)
        self.expect_drop("wrong_length", 4)
        for reason in ("not_finite", "out_of_range", "no_transform", "bad_frame"):
            self.expect_drop(reason)
        state = self.after(5)
        self.assertLess(distance(vertices(state.guide_vertices), REST), 1e-12)
        guide.publish(cloud(REST, 1.10, kind=PointField.FLOAT32))
        guide.publish(cloud(REST, 1.10))
        self.expect_drop("out_of_order")

    def late(self, motion):
        """A guide that rises by 0.5 m/s, is silent from 0.4 s to 1 s, and comes back where it would be."""
        self.begin(motion, guide_timeout=0.3, catch_up_time=0.2)
        guide = self.publisher("/t/guide/points", PointCloud2)
        up = lambda t: [(x, y, z + 0.5 * t) for x, y, z in REST]
        heights = []
        for k in range(11):
            guide.publish(cloud(up(k / RATE), 1.0 + k / RATE))
        self.arrived()
        for k in range(150):
            if k == 100:
                self.assertEqual(self.diagnostics("inputs")["message"], "no input for guide/points")
                for j in range(20):
                    guide.publish(cloud(up(1.0 + (j + 1) / RATE), 2.0 + (j + 1) / RATE))
                self.arrived()
            state = self.after(1)
            heights.append(state.guide_vertices[0].z - 0.5)
            self.assertLess(state.constraint_errors[0], 1e-12)
        speeds = [(b - a) / STEP for a, b in zip(heights, heights[1:])]
        jolts = [abs(b - a) for a, b in zip(speeds, speeds[1:])]
        self.assertLess(max(jolts), 0.5)                  # [m/s] between two steps
        self.assertAlmostEqual(heights[-1], 0.75, delta=1e-6)
        return heights

    def test_late_guide_is_held(self):
        heights = self.late("{topic: points}")
        self.assertAlmostEqual(heights[90], 0.2, delta=1e-9)

    def test_late_guide_is_extrapolated(self):
        heights = self.late("{topic: points, late: {extrapolate: 0.2}}")
        self.assertAlmostEqual(heights[90], 0.2 + 0.5 * 0.1, delta=1e-6)

    def test_services_mesh_markers(self):
        self.begin("{topic: points}", marker_style="regions")
        markers = self.listen("/t/markers", MarkerArray)
        guide = self.publisher("/t/guide/points", PointCloud2)
        self.send_wave(guide, 1.0)
        self.after(40)
        saved = self.after(1)
        self.assertTrue(self.call("save_state", FilePath, self.path("state")).success)
        self.after(20)
        self.assertTrue(self.call("load_state", FilePath, self.path("state")).success)
        state = self.after(1)
        # the guide goes on from where it was, towards the messages
        self.assertLess(distance(vertices(state.guide_vertices), vertices(saved.guide_vertices)), 0.02)
        self.assertTrue(self.call("reset", Trigger).success)
        state = self.after(5)
        self.assertLess(distance(vertices(state.guide_vertices), REST), 1e-12)   # forgets what was sent
        mesh = rospy.wait_for_message("/t/mesh", MeshStamped, 60)
        self.assertEqual(len(mesh.vertices), 81)
        wait_until(lambda: markers.count() > 0, what="markers")
        drawn = {(m.ns, m.id): m for m in markers.last().markers}
        self.assertEqual(len(drawn[("guides/flap", 0)].points), 2 * 16)
        colors = set((round(c.r, 2), round(c.g, 2), round(c.b, 2)) for c in drawn[("cloths/flap", 0)].colors)
        self.assertGreater(len(colors), 20)
        values = self.diagnostics("simulation")
        self.assertLess(float(values["worst constraint residual over size"]), 1e-10)
        self.assertGreater(float(values["largest guide force [N]"]), 0.0)

    def test_guide_that_is_a_cloth_of_the_scene(self):
        """A gripper lifts a coarse preview by message; the shell goes with it, step by step."""
        self.start(PREVIEW, program="tracking_node")
        self.states = self.listen("/t/state", ClothState)
        hand = self.publisher("/t/grasps/hand/pose", PoseStamped)
        start = self.after(1)
        self.assertEqual((start.names, list(start.offsets), list(start.guide_offsets)), (["preview", "fine"], [0, 9], [0, 0]))
        for k in range(26):
            lifted = PoseStamped()
            lifted.header.stamp, lifted.header.frame_id = rospy.Time.from_sec(1.01 + k / RATE), "world"
            fill(lifted.pose, (0, 0, 0.2 * (k / 25.0) ** 2))
            hand.publish(lifted)
        self.arrived()
        self.after(100)
        for state in self.states.all():
            x = vertices(state.vertices)
            self.assertEqual(vertices(state.guide_vertices), x[:9])
            self.assertLess(max(state.constraint_errors), 1e-10)
        self.assertAlmostEqual(x[0][2] - 0.5, 0.2, delta=0.01)      # held; the last pose is of the step before
        fine = x[9:]
        self.assertGreater(max(p[2] for p in fine) - min(p[2] for p in fine), 0.2)   # the rest of it hangs


if __name__ == "__main__":
    run("tracking_test", Tracking)
