#!/usr/bin/python3
"""Live poses during a pause that is longer than ~guide_ahead."""
import math
import threading

import rosbag
import rospy
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped
from node_harness import SCENE, NodeCase, pose, run, status_of, wait_until
from slender_sim.msg import RodState
from std_srvs.srv import SetBool

RIGHT = "/t/grasps/right/pose"
AHEAD = 2.0   # [s] by which a busy machine may keep the node, or a message from it


class Pause(NodeCase):

    def begin(self, stamped):
        self.start(pace="wall", guide_delay=0.05, guide_ahead=AHEAD, record_bag=self.path("run.bag"))
        self.state = self.listen("/t/state", RodState)
        self.guide = self.publisher(RIGHT, PoseStamped)
        self.moving, self.z = True, 1.0
        self.thread = threading.Thread(target=self.move, args=(stamped,))
        self.thread.start()
        self.addCleanup(self.halt)

    def halt(self):
        self.moving = False
        self.thread.join()

    def move(self, stamped):
        """A gripper that goes up at 0.03 m/s, and does not know of the pause."""
        begin = rospy.get_time()
        rate = rospy.Rate(100)
        while self.moving and not rospy.is_shutdown():
            now = rospy.get_time()
            self.z = 1.0 + 0.03 * (now - begin)
            self.guide.publish(pose(1, 0, self.z, now if stamped else 0.0))
            rate.sleep()

    def followed(self):
        return abs(self.state.last().nodes[-1].z - self.z) < 0.015   # 0.5 s of its way

    def check(self, stamped):
        self.begin(stamped)
        wait_until(lambda: self.state.count() > 50 and self.followed() and self.z > 1.01, what="a node that follows")
        self.assertTrue(self.call("pause", SetBool, True).success)
        before = self.diagnostics("inputs")["dropped"]   # without stamps two that come within one step are equal
        if stamped:
            self.assertEqual(before, "0")
        rospy.sleep(2.5 * AHEAD)
        inputs = self.diagnostics("inputs")
        self.assertEqual(inputs["dropped"], before, inputs)
        last = self.state.last()
        self.assertTrue(self.call("pause", SetBool, False).success)
        wait_until(lambda: self.state.last().step > last.step + 200 and self.followed(),
                   what="a node that has caught up")
        inputs = self.diagnostics("inputs")
        self.assertEqual(inputs["dropped from_future"], "0", inputs)
        if stamped:
            self.assertEqual(inputs["dropped"], "0", inputs)
        self.halt()
        ends = [(m.step, m.nodes[-1]) for m in self.state.all() if m.step >= last.step]
        speed = max(math.dist((a.x, a.y, a.z), (b.x, b.y, b.z)) / (0.005 * (k - j))
                    for (j, a), (k, b) in zip(ends, ends[1:]))
        self.assertLess(speed, 4.0)   # it catches up with 0.15 m at a mean of 1 m/s, and does not jump
        self.processes[-1].terminate()
        self.assertEqual(self.processes[-1].wait(60), 0)
        text = self.output("rod.out") + self.output("rod.err")   # complete at the end
        self.assertEqual(text.count("the last messages are kept"), 1, text)

    def test_poses_of_the_present_are_followed_after_the_pause(self):
        self.check(True)
        node = self.start("", wait=False, pace="fast", replay=self.path("run.bag"), record_bag=self.path("again.bag"))
        self.assertEqual(node.wait(60), 0, self.output("rod.err"))
        raw = [[(topic, bytes(raw[1]), stamp)
                for topic, raw, stamp in rosbag.Bag(self.path(name)).read_messages(raw=True) if topic == "/t/state"]
               for name in ("run.bag", "again.bag")]
        self.assertGreater(len(raw[0]), 200)
        self.assertTrue(raw[0] == raw[1])

    def test_poses_without_a_stamp_as_well(self):
        self.check(False)

    def test_what_is_really_ahead_is_dropped_all_the_same(self):
        self.start(pace="wall", paused=True, guide_ahead=0.5)
        guide = self.publisher(RIGHT, PoseStamped)
        rospy.sleep(1.0)
        guide.publish(pose(1, 0, 1, rospy.get_time() + 60.0))
        self.expect_drop("from_future")

    def test_sparse_poses_are_no_fault(self):
        """20 Hz, as of the tutorials' `rostopic pub -r 20`: two intervals are longer than ~guide_delay. The clock is
        the simulated one, so that each pose comes when it should, however busy the machine is."""
        self.start(guide_delay=0.05, diagnostics_rate=1000.0)
        guide = self.publisher(RIGHT, PoseStamped)
        reports = self.listen("/diagnostics", DiagnosticArray)
        self.time = 1.0

        def status_after(late):
            """Four seconds of poses that come so late [s]."""
            for _ in range(80):
                guide.publish(pose(1, 0, 1, self.time - late))
                self.arrived(reports)
                answer = self.step(10)
                self.time = answer.stamp.to_sec()
            wait_until(lambda: int(status_of(reports.last(), "simulation")["step"]) == answer.step, what="a report")
            return status_of(reports.last(), "inputs")
        inputs = status_after(late=0.0)
        self.assertEqual((inputs["level"], inputs["message"]), (0, "ok"))
        self.assertGreater(float(inputs["input lag right [s]"]), 0.08)
        inputs = status_after(late=0.15)
        self.assertEqual(inputs["level"], 1)
        self.assertIn("ms later than ~guide_delay allows: right lags by ", inputs["message"])


if __name__ == "__main__":
    run("pause_test", Pause)
