#!/usr/bin/python3
"""Wrenches in the frames of grasps, their tf frames, the low-pass filter, and the world's axes on request."""
import math
import subprocess

import rosbag
import rospy
import tf2_ros
from geometry_msgs.msg import WrenchStamped
from slender_sim.msg import GraspStates, RodState
from slender_sim.srv import EditScene, SetGrasp, SetGraspRequest
from std_srvs.srv import Trigger
from tf2_msgs.msg import TFMessage

from node_harness import SCENE, NodeCase, find_program, run, wait_until

STEP = 0.005
# the end of the rope points down: the grasp's axes are not those of the world
HANGING = SCENE.replace("to: [1, 0, 1]", "to: [0, 0, 0]").replace("motion: {topic: true}, attach: initial",
                                                                  "motion: fixed")


def rotated(q, v):
    """The vector v, given in a frame of orientation q, in the axes outside."""
    t = [2 * (q.y * v.z - q.z * v.y), 2 * (q.z * v.x - q.x * v.z), 2 * (q.x * v.y - q.y * v.x)]
    return (v.x + q.w * t[0] + q.y * t[2] - q.z * t[1], v.y + q.w * t[1] + q.z * t[0] - q.x * t[2],
            v.z + q.w * t[2] + q.x * t[1] - q.y * t[0])


class Wrenches(NodeCase):

    def begin(self, **parameters):
        self.start(HANGING, **parameters)
        self.states = self.listen("/t/grasp_states", GraspStates)
        self.raw, self.filtered = [self.listen("/t/grasps/left/" + name, WrenchStamped)
                                   for name in ("wrench", "wrench_filtered")]

    def after(self, n):
        stamp = self.step(n).stamp
        return self.states.at(stamp), self.raw.at(stamp), self.filtered.at(stamp)

    def test_axes_are_those_of_the_grasp(self):
        buffer = tf2_ros.Buffer()
        listener = tf2_ros.TransformListener(buffer)
        self.begin()
        self.listen("/tf", TFMessage)   # the buffer shares its connection
        states, wrench, _ = self.after(200)
        self.assertEqual(wrench.header.frame_id, "t/rod/grasps/left")
        q = states.pose[states.name.index("left")].orientation
        force, torque = rotated(q, wrench.wrench.force), rotated(q, wrench.wrench.torque)
        self.assertGreater(math.hypot(wrench.wrench.force.y, wrench.wrench.force.z) + abs(wrench.wrench.force.x), 0.01)
        wait_until(lambda: buffer.can_transform("world", wrench.header.frame_id, wrench.header.stamp),
                   what="the frame of the grasp")
        frame = buffer.lookup_transform("world", wrench.header.frame_id, wrench.header.stamp).transform
        p = states.pose[states.name.index("left")].position
        self.assertEqual((frame.translation.x, frame.translation.y, frame.translation.z), (p.x, p.y, p.z))
        self.assertEqual((frame.rotation.w, frame.rotation.z), (q.w, q.z))
        listener.unregister()
        self.tearDown()

        self.setUp()
        self.begin(wrench_frame="world", record_bag=self.path("run.bag"))
        _, world, _ = self.after(200)
        self.assertEqual(world.header.frame_id, "world")
        for expected, got in ((force, world.wrench.force), (torque, world.wrench.torque)):
            for a, b in zip(expected, (got.x, got.y, got.z)):
                self.assertAlmostEqual(a, b, delta=1e-12)   # roundings of one rotation
        self.assertLess(world.wrench.force.z, -0.05)        # the rope hangs from it

    def test_a_filtered_wrench_follows_within_its_time(self):
        self.begin(wrench_filter=0.1)
        _, raw, filtered = self.after(400)
        self.assertAlmostEqual(filtered.wrench.force.x, raw.wrench.force.x, delta=1e-3 * abs(raw.wrench.force.x))
        before = filtered.wrench.force.x
        self.assertTrue(self.call("set_grasp", SetGrasp,
                                  SetGraspRequest(name="left", action=SetGraspRequest.RELEASE)).success)
        _, raw, filtered = self.after(1)
        self.assertEqual(raw.wrench.force.x, 0.0)
        far = "bodies: [{name: far, mass: 1, shape: {sphere: {radius: 0.1}}, pose: {position: [9, 0, 0]}}]"
        self.assertTrue(self.call("spawn", EditScene, far).success)   # an edit does not begin the filter anew
        _, raw, filtered = self.after(19)                   # 0.1 s in all
        size = math.sqrt(sum(c * c
                             for c in (filtered.wrench.force.x, filtered.wrench.force.y, filtered.wrench.force.z)))
        # 0.1 s are one time constant
        self.assertAlmostEqual(size, math.exp(-1) * abs(before), delta=2e-3 * abs(before))
        self.assertTrue(self.call("reset", Trigger).success)
        wait_until(lambda: self.raw.last().header.stamp == self.filtered.last().header.stamp > raw.header.stamp,
                   what="the wrenches after the reset")
        self.assertEqual(self.filtered.last().wrench, self.raw.last().wrench)   # the filter begins anew

    def test_recorded_topics_and_own_bags_give_the_same_tables(self):
        self.start(HANGING, record_bag=self.path("own.bag"))
        topics = {"/t/" + name: kind
                  for name, kind in (("grasp_states", GraspStates), ("grasps/left/wrench", WrenchStamped))}
        listeners = {topic: self.listen(topic, kind) for topic, kind in topics.items()}
        listeners["/t/state"] = self.listen("/t/state", RodState)
        stamp = self.step(50).stamp
        for listener in listeners.values():
            listener.at(stamp)
        with rosbag.Bag(self.path("topics.bag"), "w") as bag:
            for topic, listener in listeners.items():
                for message in listener.all():
                    bag.write(topic, message, message.header.stamp)
        self.processes[-1].terminate()
        self.assertEqual(self.processes[-1].wait(60), 0, self.output("rod.err"))
        rows = {}
        for name in ("own", "topics"):
            subprocess.run([find_program("bag_to_csv"), self.path(name + ".bag"), "--out", self.path(name)], check=True,
                           stdout=subprocess.DEVNULL)
            with open(self.path(name + "/grasps.csv")) as file:
                lines = [line.strip().split(",") for line in file]
            rows[name] = {(row["t [s]"], row["grasp"]): row
                          for row in (dict(zip(lines[0], line)) for line in lines[1:])}
        compared = 0
        for key, row in rows["topics"].items():
            if key[1] != "left" or key not in rows["own"]:
                continue
            for column in ("fx [N]", "fy [N]", "fz [N]", "tx [N m]", "ty [N m]", "tz [N m]"):
                self.assertAlmostEqual(float(row[column]), float(rows["own"][key][column]), delta=1e-12)
                compared += 1
        self.assertGreater(compared, 100)


if __name__ == "__main__":
    run("wrenches_test", Wrenches)
