#!/usr/bin/python3
"""Every topic of rod_node: type, frame, stamps, sizes; bags; the scene; two equal runs."""
import hashlib
import math
import subprocess

import rosbag
import rosgraph
import rospy
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseArray, WrenchStamped
from node_harness import SCENE, NodeCase, find_program, numbers, run, wait_until
from slender_sim.msg import BodyStates, Fields, GraspStates, RodState
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import Marker, MarkerArray

TOPICS = {
    "/t/state": "slender_sim/RodState",
    "/t/poses": "geometry_msgs/PoseArray",
    "/t/markers": "visualization_msgs/MarkerArray",
    "/t/scene": "std_msgs/String",
    "/t/grasps/left/wrench": "geometry_msgs/WrenchStamped",
    "/t/grasps/right/wrench": "geometry_msgs/WrenchStamped",
    "/t/grasp_states": "slender_sim/GraspStates",
    "/diagnostics": "diagnostic_msgs/DiagnosticArray",
}

INPUTS = {"/t/grasps/right/pose": "geometry_msgs/PoseStamped", "/t/guides": "geometry_msgs/PoseArray"}


def turned(scene):
    """The scene turned by 90 degrees about the y axis: x -> -z, z -> x."""
    return (scene.replace("gravity: [0, 0, -9.81]", "gravity: [-9.81, 0, 0]")
            .replace("from: [0, 0, 1], to: [1, 0, 1]", "from: [1, 0, 0], to: [1, 0, -1]"))


class Topics(NodeCase):

    def test_types(self):
        self.start()
        master = rosgraph.Master("/test")
        types = dict(master.getTopicTypes())
        publications, subscriptions, services = master.getSystemState()
        published = {topic for topic, nodes in publications if "/t/rod" in nodes}
        for topic, kind in TOPICS.items():
            self.assertIn(topic, published)
            self.assertEqual(types[topic], kind)
        subscribed = {topic for topic, nodes in subscriptions if "/t/rod" in nodes}
        for topic, kind in INPUTS.items():
            self.assertIn(topic, subscribed)
            self.assertEqual(types[topic], kind)
        self.assertNotIn("/t/grasps/left/pose", subscribed)   # fixed
        self.assertNotIn("/t/bodies", subscribed)             # no grasp follows one
        self.assertNotIn("/clock", published)
        self.assertNotIn("/t/obstacle_states", published)     # the scene has none
        self.assertNotIn("/t/fields", published)              # it records none
        offered = {service for service, nodes in services if "/t/rod" in nodes}
        for name in ("pause", "reset", "step", "set_grasp", "save_state", "load_state"):
            self.assertIn("/t/rod/" + name, offered)

    def test_warnings_of_the_scene_are_logged(self):
        scene = SCENE.replace("cross_section: {radius: 0.004}", "cross_section: {ellipse: [0.004, 0.002]}\n    contact: {}")
        self.start(scene)
        wait_until(lambda: "half-axes 0.004 m and 0.002 m" in self.output("rod.out") + self.output("rod.err"), what="the warning")

    def test_messages(self):
        self.start(frame_id="map", start_time=10.0, wrench_frame="world")
        state = self.listen("/t/state", RodState)
        poses = self.listen("/t/poses", PoseArray)
        wrench = self.listen("/t/grasps/left/wrench", WrenchStamped)
        markers = self.listen("/t/markers", MarkerArray)
        self.step(50)
        for listener in (state, poses, wrench):
            wait_until(lambda: listener.count() >= 50, what="50 messages")
            stamps = [m.header.stamp.to_nsec() for m in listener.all()]
            self.assertEqual(stamps, [10000000000 + 5000000 * k for k in range(1, 51)])
            self.assertEqual({m.header.frame_id for m in listener.all()}, {"map"})
        last = state.last()
        self.assertEqual((last.name, last.closed, last.step, last.epoch), ("rope", False, 50, 0))
        self.assertEqual([m.step for m in state.all()], list(range(1, 51)))
        self.assertEqual((len(last.nodes), len(last.velocities), len(last.twists)), (21, 21, 21))
        self.assertEqual((len(last.frames), len(last.radii), len(last.radii_b)), (20, 20, 0))
        self.assertTrue(all(math.isfinite(x) for x in numbers(last)))
        self.assertLess(min(p.z for p in last.nodes), 0.95)   # it fell
        self.assertEqual(len(poses.last().poses), 20)
        self.assertEqual(poses.last().poses[7].orientation, last.frames[7])
        wait_until(lambda: markers.count() > 0, what="markers")
        names = [(m.ns, m.id, m.type, m.header.frame_id) for m in markers.last().markers if m.action == Marker.ADD]
        self.assertEqual(names[0], ("rods/rope", 0, Marker.TRIANGLE_LIST, "map"))
        self.assertEqual([n[:2] for n in names[1:]], [("grasps", 0), ("grasps", 1)])
        tube = markers.last().markers[0]
        self.assertEqual(len(tube.points), len(tube.colors))
        self.assertEqual(len(tube.points) % 3, 0)

    def test_fields(self):
        """The fields of a step follow from the state of that step, and are those in the bag."""
        bag, n = self.path("fields.bag"), 40
        scene = SCENE + "record: {fields: [strain, force, energy]}\n"
        node = self.start(scene, frame_id="map", start_time=10.0, record_bag=bag)
        state = self.listen("/t/state", RodState)
        fields = self.listen("/t/fields", Fields)
        self.step(n)
        wait_until(lambda: state.count() >= n and fields.count() >= n, what="%d messages" % n)
        states, told = state.all(), fields.all()
        self.assertEqual([m.step for m in told], list(range(1, n + 1)))
        for of_state, message in zip(states, told):
            self.assertEqual((message.step, message.epoch, message.header.stamp),
                             (of_state.step, of_state.epoch, of_state.header.stamp))
            self.assertEqual(message.header.frame_id, "map")
            self.assertEqual([(table.table, table.object) for table in message.tables],
                             [("rod_fields", "rope"), ("energies", "rope")])
            of_rod, energies = message.tables
            self.assertEqual(of_rod.columns, ["strain", "tension [N]", "fx [N]", "fy [N]", "fz [N]"])
            width = len(of_rod.columns)
            rows = [of_rod.values[k:k + width] for k in range(0, len(of_rod.values), width)]
            self.assertEqual(len(rows), 21)      # one per node
            self.assertEqual(rows[20], rows[19])   # of the edge; the last node repeats it
            for a, b, row in zip(of_state.nodes, of_state.nodes[1:], rows):
                length = math.dist((a.x, a.y, a.z), (b.x, b.y, b.z))
                # edges are 0.05 m long at rest; the tolerances are round-off
                self.assertAlmostEqual(row[0], length / 0.05 - 1.0, delta=1e-12)
                along = sum(f * (q - p) / length for f, p, q in zip(row[2:], (a.x, a.y, a.z), (b.x, b.y, b.z)))
                self.assertAlmostEqual(row[1], along, delta=1e-12 * max(1.0, abs(along)))
            self.assertEqual(len(energies.values), len(energies.columns))
        node.terminate()
        self.assertEqual(node.wait(60), 0)
        with rosbag.Bag(bag) as file:
            recorded = [m for _, m, _ in file.read_messages("/t/fields")]
        def plain(messages):
            return [[(t.table, t.object, list(t.columns), list(t.values)) for t in m.tables] for m in messages]
        self.assertEqual(plain(recorded[1:]), plain(told))   # the first one is that of the start

    def test_marker_style(self):
        self.start(marker_style="line", marker_frames=True)
        markers = self.listen("/t/markers", MarkerArray)
        wait_until(lambda: markers.count() > 0, what="markers")
        kinds = {m.ns: m.type for m in markers.last().markers}
        self.assertEqual(kinds["rods/rope"], Marker.LINE_STRIP)
        self.assertEqual(kinds["frames/rope"], Marker.LINE_LIST)

    def test_frame_is_known_to_tf(self):
        """A viewer whose fixed frame it is finds it in tf without anybody else's transforms."""
        self.start(frame_id="map")
        frames = self.listen("/tf_static", TFMessage)
        wait_until(lambda: frames.count() > 0, what="a static transform")
        transform = frames.last().transforms[0]
        self.assertEqual((transform.header.frame_id, transform.child_frame_id), ("map", "t/rod/origin"))
        self.assertEqual(transform.transform.rotation.w, 1.0)

    def test_scene_is_latched(self):
        self.start()
        self.step(1)
        scene = self.listen("/t/scene", String)
        wait_until(lambda: scene.count() == 1, what="the scene")
        self.assertIn("test_rope", scene.last().data)

    def test_state_every(self):
        self.start(state_every=10)
        state = self.listen("/t/state", RodState)
        self.step(30)
        wait_until(lambda: state.count() == 3, what="3 states")
        self.assertEqual([m.step for m in state.all()], [10, 20, 30])

    def test_several_rods(self):
        rod = SCENE[SCENE.index("  - name: rope"):]
        self.start(SCENE + rod.replace("name: rope", "name: second").replace("0, 1]", "0, 2]").replace("left", "back").replace("right", "front"))
        state = self.listen("/t/state", RodState)
        poses = self.listen("/t/poses", PoseArray)
        second = self.listen("/t/rods/second/poses", PoseArray)
        self.listen("/t/grasps/back/wrench", WrenchStamped)
        self.step(3)
        wait_until(lambda: state.count() == 6 and poses.count() == 3 and second.count() == 3, what="states of two rods")
        self.assertEqual([m.name for m in state.all()], ["rope", "second"] * 3)
        self.assertEqual(len(poses.last().poses), 40)
        self.assertEqual(poses.last().poses[20:], second.last().poses)

    def test_diagnostics(self):
        self.start()
        self.step(5)
        wait_until(lambda: int(self.diagnostics("simulation")["step"]) == 5, what="diagnostics of step 5")
        values = self.diagnostics("simulation")
        self.assertEqual(values["level"], 0)
        for key in ("mean step time [ms]", "real-time factor", "iterations per step", "residual", "energy [J]"):
            self.assertTrue(math.isfinite(float(values[key])), key)
        self.assertEqual(self.diagnostics("inputs")["input age right [s]"], "none yet")

    def wrench_sum(self, scene, axis):
        """Force on both grippers along an axis when the rope has come to rest."""
        self.start(scene, wrench_frame="world")
        listeners = [self.listen("/t/grasps/%s/wrench" % g, WrenchStamped) for g in ("left", "right")]
        stamp = self.step(3000).stamp
        wait_until(lambda: all(l.count() and l.last().header.stamp >= stamp for l in listeners), what="wrenches")
        total = [sum(getattr(l.last().wrench.force, a) for l in listeners) for a in "xyz"]
        return total[axis], math.sqrt(sum(v * v for i, v in enumerate(total) if i != axis))

    def test_wrenches_carry_the_weight(self):
        weight = 1100 * math.pi * 0.004 ** 2 * 9.81
        upright, across = self.wrench_sum(SCENE, 2)
        # At rest but for what damping has left after 15 s, and Newton's tolerance.
        self.assertAlmostEqual(upright / -weight, 1.0, delta=1e-4)
        self.assertLess(across, 1e-4 * weight)
        self.tearDown()
        self.setUp()
        sideways, across = self.wrench_sum(turned(SCENE), 0)
        self.assertAlmostEqual(sideways / upright, 1.0, delta=1e-5)
        self.assertLess(across, 1e-4 * weight)

    def test_grasps_and_obstacles(self):
        self.start(SCENE + "obstacles: [{name: ball, shape: {sphere: {radius: 0.1}}, pose: {position: [0, 3, 0]}}]\n")
        grasps, obstacles = self.listen("/t/grasp_states", GraspStates), self.listen("/t/obstacle_states", BodyStates)
        stamp = self.step(3).stamp
        for told in (grasps, obstacles):
            wait_until(lambda: told.count() == 3 and told.last().header.stamp == stamp, what="three messages")
        last = grasps.last()
        self.assertEqual((last.name, last.object, list(last.active)), (["left", "right"], ["rope", "rope"], [True, True]))
        self.assertAlmostEqual(last.pose[1].position.x, 1.0, delta=0.06)   # the middle of the last edge
        self.assertEqual((obstacles.last().name, obstacles.last().pose[0].position.y), (["ball"], 3.0))

    def record(self, name):
        process = self.start(wait=False, pace="fast", stop_after=1.0, record_bag=self.path(name))
        self.assertEqual(process.wait(60), 0, self.output("rod.err"))
        with open(self.path(name), "rb") as file:
            return hashlib.sha256(file.read()).hexdigest()

    def test_two_runs_write_identical_bags(self):
        self.assertEqual(self.record("first.bag"), self.record("new/folder/second.bag"))
        counts, last = {}, None
        for topic, message, stamp in rosbag.Bag(self.path("first.bag")).read_messages():
            counts[topic] = counts.get(topic, 0) + 1
            if topic == "/t/state":
                self.assertEqual(message.header.stamp, stamp)
                self.assertEqual(message.step, 0 if last is None else last + 1)
                last = message.step
        self.assertEqual(counts, {"/t/scene": 1, "/t/state": 201, "/t/grasps/left/wrench": 201, "/t/grasps/right/wrench": 201,
                                  "/t/grasp_states": 201})
        self.assertIn("real-time factor", self.output("rod.out"))

    def test_simulate_writes_the_same_states(self):
        self.record("node.bag")
        with open(self.path("scene.yaml"), "w") as file:
            file.write(SCENE)
        subprocess.run([find_program("simulate"), self.path("scene.yaml"), "--duration", "1", "--quiet", "--bag", self.path("tool.bag")],
                       check=True)
        bags = [[(raw[1], stamp) for topic, raw, stamp in rosbag.Bag(self.path(name)).read_messages([topic], raw=True)]
                for name, topic in (("node.bag", "/t/state"), ("tool.bag", "/state"))]
        self.assertEqual(len(bags[0]), 201)
        self.assertTrue(bags[0] == bags[1])

    def test_bag_is_complete_when_terminated(self):
        process = self.start(pace="fast", record_bag=self.path("cut.bag"))
        wait_until(lambda: int(self.diagnostics("simulation")["step"]) > 100, what="steps")
        process.terminate()
        process.wait(60)
        steps = [m.step for topic, m, stamp in rosbag.Bag(self.path("cut.bag")).read_messages(["/t/state"])]
        self.assertGreater(len(steps), 10)
        self.assertEqual(steps, list(range(len(steps))))


if __name__ == "__main__":
    run("topics_test", Topics)
