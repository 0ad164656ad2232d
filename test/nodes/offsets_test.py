#!/usr/bin/python3
"""Where the held section is in its gripper: given by the scene, or as the first pose found it. Both last."""
import math

import rospy
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped
from slender_sim.msg import BodyStates, GraspStates
from slender_sim.srv import FilePath
from std_srvs.srv import Trigger

from node_harness import SCENE, NodeCase, fill, pose, run

RIGHT = "/t/grasps/right/pose"
GIVEN = SCENE.replace("attach: initial", "offset: {position: [0.05, 0, 0.1]}")
HOME = (0.95, 0, 0.9)   # of the gripper: the end of the rope is at (1, 0, 1)
AWAY = (0.90, -0.14, 0.86)


def end_at(gripper):
    return gripper[0] + 0.05, gripper[1], gripper[2] + 0.1


class Offsets(NodeCase):

    def begin(self, scene):
        self.start(scene, guide_delay=0.05)
        self.grasps = self.listen("/t/grasp_states", GraspStates)
        self.gripper = self.publisher(RIGHT, PoseStamped)
        self.reports = self.listen("/diagnostics", DiagnosticArray)
        self.stamp = 1.0

    def stream(self, place, seconds=0.6):
        """Holds the gripper at a place and sends its poses at 50 Hz. Returns the position of the end of the rope."""
        for _ in range(int(50 * seconds)):
            self.gripper.publish(pose(*place, self.stamp))
            self.arrived(self.reports)
            stamp = self.step(4).stamp
            self.stamp += 0.02
        p = self.grasps.at(stamp).pose[1].position
        return p.x, p.y, p.z

    def assert_at(self, place, expected):
        self.assertLess(math.dist(place, expected), 1e-6, "%s, expected %s" % (place, expected))

    def test_a_first_pose_that_comes_late(self):
        self.begin(GIVEN)
        self.assert_at(self.stream((0.95, 0.06, 0.9)), (1, 0.06, 1))   # 6 cm from home

    def test_a_reset_while_poses_stream(self):
        for scene in (GIVEN, SCENE):   # with attach: initial the first pose finds the gripper at home
            self.begin(scene)
            self.assert_at(self.stream(HOME), (1, 0, 1))
            self.assert_at(self.stream(AWAY), end_at(AWAY))
            self.assertTrue(self.call("reset", Trigger).success)
            self.stamp += 0.005   # the reset takes one
            self.assert_at(self.stream(AWAY), end_at(AWAY))
            self.assert_at(self.stream(HOME), (1, 0, 1))
            self.tearDown()
            self.setUp()

    def test_a_state_is_loaded(self):
        self.begin(GIVEN)
        self.assert_at(self.stream(HOME), (1, 0, 1))
        self.assertTrue(self.call("save_state", FilePath, self.path("home")).success)
        self.assert_at(self.stream(AWAY), end_at(AWAY))
        self.assertTrue(self.call("load_state", FilePath, self.path("home")).success)
        self.stamp += 0.005
        self.assert_at(self.stream(AWAY), end_at(AWAY))

    def test_a_body_that_messages_know(self):
        self.start(GIVEN.replace("{topic: true}", "{body: hand}"), guide_delay=0.05)
        grasps = self.listen("/t/grasp_states", GraspStates)
        hand = self.publisher("/t/bodies", BodyStates)
        message = BodyStates()
        message.header.frame_id, message.header.stamp = "world", rospy.Time(1)
        message.name, message.pose = ["hand"], [fill(pose(0, 0, 0).pose, AWAY)]
        hand.publish(message)
        self.arrived()
        p = grasps.at(self.step(200).stamp).pose[1].position
        self.assert_at((p.x, p.y, p.z), end_at(AWAY))


if __name__ == "__main__":
    run("offsets_test", Offsets)
