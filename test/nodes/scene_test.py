#!/usr/bin/python3
"""scene_node: rod, thread, cloth, tracked shell and body in one scene; who accepts which scene."""
import math

import rosbag
import rospy
from geometry_msgs.msg import PoseArray, PoseStamped, WrenchStamped
from sensor_msgs.msg import PointCloud2
from slender_sim.msg import BodyStates, ClothState, MeshStamped, RodState, ThreadState
from slender_sim.srv import FilePath, SetFunctions, SetGrasp, SetGraspRequest
from std_srvs.srv import Trigger
from visualization_msgs.msg import MarkerArray

from node_harness import NodeCase, numbers, pose, run, wait_until

STEP = 0.004
RODS = """
rods:
  - name: rope
    centerline: {straight: {from: [-0.1, 0, 0.3], to: [0.1, 0, 0.3], edges: 16}}
    cross_section: {radius: 0.004}
    material: {density: 1100, youngs_modulus: 2.0e5}
    damping: {stiffness: 0.002}
    grasps:
      left: {edges: [0], motion: {topic: true}, attach: initial}
"""
THREADS = """
threads:
  - name: honey
    fluid: {density: 1400, viscosity: 60, surface_tension: 0.06}
    nozzle: {position: [0, 0.3, 0.2], diameter: 0.008, flow: 2.5e-6, motion: {topic: true}}
    edges: {feed: 0.003, longest: 0.004, shortest: 0.0015}
"""
CLOTHS = """
cloths:
  - name: napkin
    grid: {corner: [-0.08, -0.07, 0], sides: [[0.16, 0, 0], [0, 0.14, 0]], cells: [4, 4], pattern: alternating}
    material: {area_density: 0.2, thickness: 0.0005, youngs_modulus: 5.0e5}
    damping: {stiffness: 0.002}
    grasps: {corner: {corner: lower_left}, other: {corner: upper_right}}
"""
TRACKED = """
tracked:
  - name: shell
    guide: {cloth: napkin}
    mesh: {subdivide: 2}
    material: {area_density: 0.2, thickness: 0.0005, youngs_modulus: 5.0e5}
    damping: {stiffness: 0.002}
"""
BODIES = """
bodies:
  - {name: ball, mass: 0.008, shape: {sphere: {radius: 0.012}}, pose: {position: [-0.045, 0.02, 0.4]},
     broadcast_tf: true}
obstacles:
  - {name: floor, shape: {box: {size: [2, 2, 0.02]}}, pose: {position: [0, 0, -1]}}
"""
HEAD = "name: mixed\ntime: {step: %g, duration: 1}\n" % STEP
MIXED = HEAD + RODS + THREADS + CLOTHS + TRACKED + BODIES


def cloth_numbers(state):
    return [c for p in list(state.vertices) + list(state.velocities) for c in (p.x, p.y, p.z)]


def thread_numbers(state):
    return [c for p in list(state.nodes) + list(state.velocities) for c in (p.x, p.y, p.z)]


class Scene(NodeCase):

    def begin(self, scene=MIXED, **parameters):
        process = self.start(scene, program=parameters.pop("program", "scene_node"), **parameters)
        self.rods = self.listen("/t/rods/state", RodState)
        self.threads = self.listen("/t/threads/state", ThreadState)
        self.cloths = self.listen("/t/cloths/state", ClothState)
        return process

    def after(self, n):
        """All numbers of the three kinds after n steps."""
        stamp = self.step(n).stamp
        return (numbers(self.rods.at(stamp)), thread_numbers(self.threads.at(stamp)),
                cloth_numbers(self.cloths.at(stamp)))

    def test_each_kind_has_its_own_topics(self):
        self.begin()
        listeners = {topic: self.listen("/t/" + topic, kind) for topic, kind in (
            ("rods/poses", PoseArray), ("threads/poses", PoseArray), ("cloths/points", PointCloud2),
            ("cloths/mesh", MeshStamped),
            ("body_states", BodyStates), ("grasps/left/wrench", WrenchStamped), ("nozzle/wrench", WrenchStamped),
            ("markers", MarkerArray))}
        stamp = self.step(10).stamp
        seldom = ("markers", "cloths/mesh")   # not at every step
        told = {topic: listener.at(stamp) for topic, listener in listeners.items() if topic not in seldom}
        rods, threads, cloths = [listener.at(stamp) for listener in (self.rods, self.threads, self.cloths)]
        for topic in seldom:
            wait_until(lambda: listeners[topic].count() > 0, what="messages on " + topic)
        published = {topic for topic, _ in rospy.get_published_topics("/t")}
        self.assertFalse(published & {"/t/state", "/t/poses", "/t/points", "/t/mesh"}, published)
        self.assertEqual(len(told["rods/poses"].poses), 16)
        self.assertEqual(len(told["threads/poses"].poses), len(threads.nodes) - 1)
        self.assertEqual(cloths.names, ["napkin", "shell"])
        self.assertEqual(told["cloths/points"].width, len(cloths.vertices))
        self.assertEqual(rods.name, "rope")
        drawn = {marker.ns for marker in listeners["markers"].last().markers}
        for name in ("rods/rope", "threads/honey", "cloths/napkin", "bodies"):
            self.assertIn(name, drawn)
        values = self.diagnostics("simulation")
        for key in ("energy [J]", "largest guide force [N]", "vertices"):
            self.assertIn(key, values)

    def test_inputs_and_services_reach_every_kind(self):
        self.begin()
        gripper = self.publisher("/t/grasps/left/pose", PoseStamped)
        nozzle = self.publisher("/t/nozzle/pose", PoseStamped)
        self.after(1)
        start = self.rods.last().nodes[0]
        for k in range(1, 41):
            t = 1.0 + k * STEP
            gripper.publish(pose(-0.1, 0, 0.3 + 0.001 * k, t))
            nozzle.publish(pose(0.0005 * k, 0.3, 0.2, t, q=(0, math.sqrt(0.5), 0, math.sqrt(0.5))))
        self.arrived()
        self.after(60)
        self.assertAlmostEqual(self.rods.last().nodes[0].z - start.z, 0.04, delta=0.002)
        self.assertAlmostEqual(self.threads.last().nodes[-1].x, 0.02, delta=1e-9)
        answer = self.call("set_grasp", SetGrasp, SetGraspRequest(name="corner", action=SetGraspRequest.ATTACH_NODES))
        self.assertIn("corner holds napkin already", answer.message)
        self.assertTrue(self.call("set_grasp", SetGrasp,
                                  SetGraspRequest(name="corner", action=SetGraspRequest.RELEASE)).success)
        self.assertIn("test function", self.call("set_functions", SetFunctions, "shell", "none", 0.0).message)

    def test_saved_states_go_on_bit_by_bit(self):
        self.begin()
        self.after(20)
        self.assertTrue(self.call("save_state", FilePath, self.path("state")).success)
        expected = self.after(15)
        self.assertTrue(self.call("reset", Trigger).success)
        self.assertTrue(self.call("load_state", FilePath, self.path("state")).success)
        self.assertEqual(self.after(15), expected)

    def test_bags_are_identical_and_replay_repeats_them(self):
        for name in ("one.bag", "two.bag"):
            node = self.start(MIXED, program="scene_node", wait=False, pace="fast", stop_after=0.2,
                              record_bag=self.path(name))
            self.assertEqual(node.wait(100), 0, self.output("rod.err"))
        with open(self.path("one.bag"), "rb") as one, open(self.path("two.bag"), "rb") as two:
            self.assertTrue(one.read() == two.read())
        with rosbag.Bag(self.path("one.bag")) as bag:
            topics = set(bag.get_type_and_topic_info().topics)
        self.assertTrue({"/t/rods/state", "/t/threads/state", "/t/cloths/state", "/t/cloths/mesh",
                         "/t/body_states"} <= topics, topics)

        node = self.begin(pace="wall", guide_delay=0.05, stop_after=0.0, record_bag=self.path("run.bag"))
        gripper = self.publisher("/t/grasps/left/pose", PoseStamped)
        rate = rospy.Rate(50)
        for k in range(40):
            gripper.publish(pose(-0.1, 0, 0.3 + 0.02 * math.sin(0.2 * k), rospy.get_time()))
            rate.sleep()
        wait_until(lambda: self.rods.last().step > 50, timeout=200, what="a run of some length")
        node.terminate()
        self.assertEqual(node.wait(60), 0, self.output("rod.err"))
        node = self.start("", program="scene_node", wait=False, pace="fast", stop_after=0.0,
                          replay=self.path("run.bag"), record_bag=self.path("again.bag"))
        self.assertEqual(node.wait(200), 0, self.output("rod.err"))
        first, again = [[(topic, bytes(raw[1]), stamp)
                         for topic, raw, stamp in rosbag.Bag(self.path(name)).read_messages(raw=True)
                         if not topic.endswith("/inputs")] for name in ("run.bag", "again.bag")]
        self.assertGreater(len(first), 100)
        self.assertTrue(first == again)

    def test_each_node_accepts_scenes_with_its_kind(self):
        for program in ("rod_node", "thread_node", "cloth_node", "tracking_node"):
            node = self.start(MIXED, program=program, wait=False, pace="fast", stop_after=0.008)
            self.assertEqual(node.wait(60), 0, program + self.output("rod.err"))
        for program, scene, kind in (("rod_node", THREADS, "rods or bodies"), ("thread_node", RODS, "threads"),
                                     ("cloth_node", BODIES, "cloths"),
                                     ("tracking_node", RODS + CLOTHS, "cloths or rods that track a guide")):
            node = self.start(HEAD + scene, program=program, wait=False)
            self.assertEqual(node.wait(60), 2, program)
            self.assertIn("it has no %s, which %s is for; scene_node runs every scene" % (kind, program),
                          self.output("rod.err"))


if __name__ == "__main__":
    run("scene_test", Scene)
