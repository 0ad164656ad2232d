#!/usr/bin/python3
"""~replay: a run in real time, with guides, wind, pauses and service calls, is repeated from its own bag, bit by bit."""
import math
import os

import rosbag
import rospy
from geometry_msgs.msg import PoseStamped, Vector3Stamped
from slender_sim.msg import BodyStates, RodState
from slender_sim.srv import FilePath, SetGrasp, SetGraspRequest
from std_srvs.srv import SetBool, Trigger

from node_harness import SCENE, NodeCase, fill, pose, run, wait_until

RIGHT = "/t/grasps/right/pose"
WINDY = SCENE + """wind: {topic: true}
obstacles: [{name: ball, shape: {sphere: {radius: 0.05}}, pose: {position: [0.5, 3, 0]}, motion: {topic: true}}]
"""


class Replay(NodeCase):

    def swing(self, seconds):
        """Moves the gripper and the ball in real time, as trackers would."""
        rate = rospy.Rate(100)
        for _ in range(int(100 * seconds)):
            self.phase += 0.05
            now = rospy.get_time()
            self.guide.publish(pose(1, 0.1 * math.sin(self.phase), 1, now, q=(0, 0, math.sin(0.2 * self.phase), math.cos(0.2 * self.phase))))
            message = BodyStates()
            message.header.frame_id, message.header.stamp = "world", rospy.Time.from_sec(now)
            message.name, message.pose = ["ball"], [fill(pose(0, 0, 0).pose, (0.5, 3 + 0.1 * math.cos(self.phase), 0))]
            self.ball.publish(message)
            rate.sleep()

    def raw(self, bag):
        return [(topic, bytes(raw[1]), stamp) for topic, raw, stamp in rosbag.Bag(self.path(bag)).read_messages(raw=True) if not topic.endswith("/inputs")]

    def record(self):
        node = self.start(WINDY, pace="wall", guide_delay=0.05, catch_up_time=0.15, max_lag=0.3, record_bag=self.path("run.bag"))
        state = self.listen("/t/state", RodState)
        self.guide, self.ball = self.publisher(RIGHT, PoseStamped), self.publisher("/t/bodies", BodyStates)
        wind = self.publisher("/t/wind", Vector3Stamped)
        self.phase = 0.0
        self.swing(0.7)
        self.assertTrue(self.call("save_state", FilePath, self.path("state")).success)
        breeze = Vector3Stamped()
        breeze.header.frame_id, breeze.vector.y = "world", 0.7
        wind.publish(breeze)
        self.swing(0.5)
        self.assertTrue(self.call("pause", SetBool, True).success)
        rospy.sleep(0.3)
        self.assertTrue(self.call("pause", SetBool, False).success)
        self.swing(0.5)
        self.assertTrue(self.call("set_grasp", SetGrasp, SetGraspRequest(name="right", action=SetGraspRequest.RELEASE)).success)
        rospy.sleep(0.2)
        hold = SetGraspRequest(name="right", action=SetGraspRequest.ATTACH_NODES, first_node=-2, last_node=-1)
        self.assertTrue(self.call("set_grasp", SetGrasp, hold).success)
        self.swing(0.5)
        self.assertTrue(self.call("load_state", FilePath, self.path("state")).success)
        self.swing(0.4)
        self.assertTrue(self.call("reset", Trigger).success)
        self.swing(0.7)
        wait_until(lambda: state.last().epoch == 2 and state.last().step > 50, what="states after the reset")
        node.terminate()
        self.assertEqual(node.wait(60), 0, self.output("rod.err"))
        with rosbag.Bag(self.path("run.bag")) as bag:
            kinds = {message.kind for _, message, _ in bag.read_messages(topics=["/t/inputs"])}
        self.assertTrue({0, 1, 6, 7, 8, 9, 11} <= kinds, kinds)   # settings, poses, wind, reset, load, grasps, skipped time

    def test_a_run_is_repeated_bit_by_bit(self):
        self.record()
        first = self.raw("run.bag")
        self.assertGreater(len(first), 500)
        node = self.start(WINDY, wait=False, pace="fast", replay=self.path("run.bag"), record_bag=self.path("again.bag"))
        self.assertEqual(node.wait(200), 0, self.output("rod.err"))
        again = self.raw("again.bag")
        self.assertEqual(len(first), len(again))
        for k, (a, b) in enumerate(zip(first, again)):
            self.assertEqual(a, b, "message %d on %s at %s" % (k, a[0], a[2]))
        # a replay of the replay: its bag has the inputs, too
        node = self.start("", wait=False, pace="fast", replay=self.path("again.bag"), record_bag=self.path("third.bag"))
        self.assertEqual(node.wait(200), 0, self.output("rod.err"))
        self.assertTrue(self.raw("third.bag") == first)

    def test_without_inputs_the_bag_is_enough(self):
        node = self.start(wait=False, pace="fast", stop_after=0.5, record_bag=self.path("run.bag"))
        self.assertEqual(node.wait(60), 0, self.output("rod.err"))
        node = self.start(wait=False, pace="fast", stop_after=0.0, replay=self.path("run.bag"), record_bag=self.path("again.bag"))
        self.assertEqual(node.wait(60), 0, self.output("rod.err"))
        with open(self.path("run.bag"), "rb") as a, open(self.path("again.bag"), "rb") as b:
            self.assertTrue(a.read() == b.read())

    def test_the_recorded_scene_runs_whatever_an_earlier_start_left(self):
        node = self.start(wait=False, pace="fast", stop_after=0.1, record_bag=self.path("run.bag"), record_inputs=False)
        self.assertEqual(node.wait(60), 0, self.output("rod.err"))
        for scene, overrides, told in ((SCENE.replace("edges: 20", "edges: 21"), "", True),
                                       (self.path("gone.yaml"), "", True),
                                       (SCENE, "time.step=0.001", True), (SCENE, "", False)):
            node = self.start(scene, wait=False, pace="fast", stop_after=0.0, set=overrides,
                              replay=self.path("run.bag"), record_bag=self.path("again.bag"))
            self.assertEqual(node.wait(60), 0, self.output("rod.err"))
            self.assertTrue(self.raw("run.bag") == self.raw("again.bag"))
            text = self.output("rod.out") + self.output("rod.err")
            self.assertEqual("the recorded scene runs" in text, told, text)
            self.assertEqual("rosparam delete /t/rod/scene" in text, told, text)
            self.assertEqual("rosparam delete /t/rod/set" in text, told and bool(overrides), text)

    def test_a_bag_that_is_read_is_not_written(self):
        """~record_bag is left over from the run that recorded the bag."""
        run_bag = self.path("run.bag")
        node = self.start(wait=False, pace="fast", stop_after=0.1, record_bag=run_bag)
        self.assertEqual(node.wait(60), 0, self.output("rod.err"))
        os.symlink(run_bag, self.path("link.bag"))
        os.link(run_bag, self.path("hard.bag"))
        os.link(run_bag, self.path("early.bag.active"))
        os.link(run_bag, self.path("late.previous.bag"))
        with open(run_bag, "rb") as file:
            before = file.read()
        for name in ("run.bag", "link.bag", "hard.bag", "early.bag", "late.bag"):
            node = self.start("", wait=False, pace="fast", stop_after=0.0, replay=run_bag, record_bag=self.path(name))
            self.assertEqual(node.wait(60), 2, name)
            self.assertIn("which ~replay reads; name another file", self.output("rod.err"))
            self.assertIn("rosparam delete /t/rod/record_bag", self.output("rod.err"))
            with open(run_bag, "rb") as file:
                self.assertTrue(file.read() == before)

    def test_an_older_bag_is_kept(self):
        bag = self.path("run.bag")
        for _ in range(2):
            node = self.start(wait=False, pace="fast", stop_after=0.1, record_bag=bag)
            self.assertEqual(node.wait(60), 0, self.output("rod.err"))
        self.assertIn("the old one is kept as " + self.path("run.previous.bag"),
                      self.output("rod.out") + self.output("rod.err"))
        self.assertTrue(self.raw("run.bag") == self.raw("run.previous.bag"))

    def test_what_cannot_be_replayed(self):
        node = self.start(wait=False, pace="fast", stop_after=0.1, record_bag=self.path("run.bag"))
        self.assertEqual(node.wait(60), 0, self.output("rod.err"))
        for expected, scene, parameters in (("there is no such file", SCENE, {"replay": self.path("none.bag")}),
                                            ("keeps the recorded stamps", SCENE, {"replay": self.path("run.bag"), "start_time": 5.0})):
            node = self.start(scene, wait=False, stop_after=0.0, record_bag="", **dict({"start_time": 0.0}, **parameters))
            self.assertEqual(node.wait(60), 2)
            self.assertIn(expected, self.output("rod.err"))
        self.start(replay=self.path("run.bag"), start_time=0.0)
        answer = self.call("reset", Trigger)
        self.assertFalse(answer.success)
        self.assertIn("takes no other input", answer.message)


if __name__ == "__main__":
    run("replay_test", Replay)
