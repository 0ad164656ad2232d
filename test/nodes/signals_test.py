#!/usr/bin/python3
"""SIGINT and SIGTERM end each node within the step that it computes: exit status 0, a closed bag, nothing left behind.

The steps of the scenes below take minutes if nothing ends them, so that a node which ends within the time of wait() has left its step. How long it takes is
not judged.
"""
import os
import signal
import subprocess
import unittest

import rosbag
import rosgraph
import rospy
from geometry_msgs.msg import Point
from slender_sim.srv import FairMesh, FairMeshRequest

from node_harness import NodeCase, run, wait_until

# One step of 10 s whose error control asks for far more than a million substeps.
ENDLESS = "time: {step: 10, duration: 1e6, error_tolerance: 1e-14, min_step: 1e-8, integrator: implicit_euler}\n"
ROPE = ENDLESS + """
rods:
  - name: rope
    centerline: {straight: {from: [0, 0, 1], to: [1, 0, 1], edges: 1000}}
    grasps: {left: {edges: [0]}}
"""
KNOTTED = ENDLESS + """
rods:
  - {name: over, centerline: {straight: {from: [0, 0, 0.03], to: [1, 0, 0.03], edges: 400}}, contact: {friction: 0.3}}
  - {name: under, centerline: {straight: {from: [0.5, -0.5, 0], to: [0.5, 0.5, 0], edges: 400}}, contact: {friction: 0.3}, grasps: {a: {edges: [0]}, b: {edges: [-1]}}}
"""
CLOTH = """
cloths:
  - name: sheet
    grid: {corner: [0, 0, 1], sides: [[1, 0, 0], [0, 1, 0]], cells: %d}
    material: {area_density: 0.2, thickness: 0.0005, youngs_modulus: 1.0e6, poissons_ratio: 0.3}
    grasps: {left: {corner: upper_left}}
"""
# The largest cloth that a user is likely to run at once: 40,401 vertices, steps of seconds.
BIG_CLOTH = "time: {step: 0.01, duration: 1e6}\n" + CLOTH % 200
ENDLESS_CLOTH = ENDLESS + CLOTH % 60
# A single step feeds some eight hundred edges.
THREAD = """
time: {step: 10, duration: 1e6}
threads:
  - name: honey
    fluid: {viscosity: 100}
    nozzle: {position: [0, 0, 0.5], diameter: 0.004, flow: 4.0e-6}
    floor: {height: 0}
"""
# 128 x 128 cells.
TRACKED = """
time: {step: 0.01, duration: 1e6}
tracked:
  - name: shell
    guide: {grid: {corner: [0, 0, 1], sides: [[1, 0, 0], [0, 1, 0]], cells: 4}}
    mesh: {subdivide: 5}
    material: {area_density: 0.2, thickness: 0.0005, youngs_modulus: 1.0e6, poissons_ratio: 0.3}
"""


class Signals(NodeCase):

    def expect_end(self, process, name, which):
        """Sends the signal, and checks how the process ends."""
        process.send_signal(which)
        try:
            status = process.wait(240)
        except subprocess.TimeoutExpired:
            self.fail("%s is still running after %s" % (name, which))
        self.assertEqual(status, 0, self.output(name + ".err"))
        master = rosgraph.Master("/signals_test")
        state = master.getSystemState()
        self.assertFalse([topic for part in state for topic, nodes in part if "/t/" + name in nodes], "the master still knows /t/" + name)

    def stops(self, program, scene, steps_recorded=None):
        """While the node computes: the bag is opened as it begins, the first state is written before the first step."""
        for which in (signal.SIGINT, signal.SIGTERM):
            with self.subTest(program=program, signal=which):
                bag_path = self.path("run_%d.bag" % which)
                process = self.start(scene, program=program, wait=False, pace="fast", record_bag=bag_path)

                def computes():
                    self.assertIsNone(process.poll(), self.output("rod.err"))
                    try:
                        rospy.wait_for_service("/t/rod/load_state", 1)
                    except rospy.ROSException:
                        return False
                    return os.path.exists(bag_path + ".active")

                wait_until(computes, timeout=240.0, what=program)
                rospy.sleep(1.0)   # into the step
                self.expect_end(process, "rod", which)
                self.assertFalse(os.path.exists(bag_path + ".active"), "the bag was not closed")
                with rosbag.Bag(bag_path) as bag:
                    topics = {}
                    for topic, message, stamp in bag.read_messages():
                        topics.setdefault(topic, []).append(stamp)
                self.assertIn("/t/scene", topics)
                self.assertGreaterEqual(len(topics["/t/state"]), 1)
                if steps_recorded is not None:   # the step that was left is not recorded
                    self.assertEqual(len(set(topics["/t/state"])), steps_recorded)
                self.assertIn("steps", self.output("rod.out"))   # the summary
                self.assertNotIn("stopped at step", self.output("rod.err"))   # an interrupted step is no failure
                self.assertEqual({name for name in os.listdir(self.folder) if not name.startswith("run_")}, {"rod.out", "rod.err"})

    def test_rod_node(self):
        self.stops("rod_node", ROPE, 1)

    def test_rods_with_contact(self):
        self.stops("rod_node", KNOTTED, 1)

    def test_thread_node(self):
        self.stops("thread_node", THREAD)

    def test_cloth_node(self):
        self.stops("cloth_node", ENDLESS_CLOTH, 1)

    def test_big_cloth(self):
        self.stops("cloth_node", BIG_CLOTH)

    def test_tracking_node(self):
        self.stops("tracking_node", TRACKED)

    def test_paused_node(self):
        for which in (signal.SIGINT, signal.SIGTERM):
            self.expect_end(self.start(), "rod", which)

    def test_motion_player(self):
        with open(self.path("motion.csv"), "w") as table:
            table.write("t,body,x,y,z,qx,qy,qz,qw\n0,wrist,0,0,1,0,0,0,1\n1000,wrist,1,0,1,0,0,0,1\n")
        for which in (signal.SIGINT, signal.SIGTERM):
            process = self.launch("motion_player", "player", {"file": self.path("motion.csv"), "tf": True, "wait": 0.0})
            wait_until(lambda: any(topic == "/tf" for topic, _ in rospy.get_published_topics()), what="/tf")
            self.expect_end(process, "player", which)

    def test_fairing_node(self):
        """A million steps of a small mesh, which is not stationary for long."""
        n = 40
        request = FairMeshRequest(steps=1000000, smoothing=1e-3)
        request.vertices = [Point(x / n, y / n, 0.03 * ((7 * x + 13 * y) % 5)) for y in range(n) for x in range(n)]
        for y in range(n - 1):
            for x in range(n - 1):
                a = y * n + x
                request.triangles += [a, a + 1, a + n, a + 1, a + n + 1, a + n]
        with open(self.path("request"), "wb") as file:
            request.serialize(file)
        for which in (signal.SIGINT, signal.SIGTERM):
            process = self.launch("fairing_node", "fairing", {})
            rospy.wait_for_service("/t/fairing/fair_mesh", 60)
            caller = subprocess.Popen(["/usr/bin/python3", "-c", CALL, self.path("request")], stdout=subprocess.PIPE)
            self.processes.append(caller)
            self.assertEqual(caller.stdout.readline(), b"called\n")
            rospy.sleep(1.0)
            self.expect_end(process, "fairing", which)
            caller.wait(60)


CALL = """
import sys, rospy
from slender_sim.srv import FairMesh, FairMeshRequest
request = FairMeshRequest().deserialize(open(sys.argv[1], "rb").read())
proxy = rospy.ServiceProxy("/t/fairing/fair_mesh", FairMesh)
print("called", flush=True)
try:
    proxy(request)
except rospy.ServiceException:
    pass
"""


if __name__ == "__main__":
    run("signals_test", Signals)
