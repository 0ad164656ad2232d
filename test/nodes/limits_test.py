#!/usr/bin/python3
"""Key `limits` of scenes, with messages: what the node says, and each `on_limit`."""
import rosbag
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import PoseStamped
from node_harness import SCENE, NodeCase, pose, run, wait_until
from slender_sim.msg import GraspStates, RodState
from slender_sim.srv import Step
from std_srvs.srv import SetBool, Trigger

RIGHT = "/t/grasps/right/pose"
# the rope has E A = 50 N
LIMITED = SCENE + "limits: {strain: 0.2, on_limit: %s}\n"


class Limits(NodeCase):

    def begin(self, on_limit, **parameters):
        self.start(LIMITED % on_limit, guide_delay=0.05, diagnostics_rate=1000.0, record_bag=self.path("run.bag"),
                   **parameters)
        self.state, self.grasps = self.listen("/t/state", RodState), self.listen("/t/grasp_states", GraspStates)
        self.guide = self.publisher(RIGHT, PoseStamped)
        self.time, self.x = 1.0, 1.0
        self.follow(1.0, 0.1)

    def follow(self, x, seconds):
        """The gripper goes to x meanwhile, at 100 Hz. Returns the last state, or why a step was refused."""
        samples = int(round(seconds / 0.01))
        way = (x - self.x) / samples
        reports = self.listen("/diagnostics", DiagnosticArray)
        try:
            for _ in range(samples):
                self.x += way
                self.time += 0.01
                self.guide.publish(pose(self.x, 0, 1, self.time))
                self.arrived(reports)
                answer = self.call("step", Step, 2)
                if not answer.success:
                    return answer.message
        finally:
            reports.subscriber.unregister()   # so that diagnostics() connects anew
        return self.state.at(answer.stamp)

    def warnings(self):
        return self.output("rod.out") + self.output("rod.err")

    def raw(self, bag):
        return [(topic, bytes(raw[1]), stamp)
                for topic, raw, stamp in rosbag.Bag(self.path(bag)).read_messages(raw=True)
                if not topic.endswith("/inputs")]

    def replayed(self):
        """Ends the node and repeats its run, which must be the same."""
        self.processes[-1].terminate()
        self.assertEqual(self.processes[-1].wait(60), 0, self.warnings())
        node = self.start("", wait=False, pace="fast", replay=self.path("run.bag"), record_bag=self.path("again.bag"))
        self.assertEqual(node.wait(60), 0, self.warnings())
        first, again = self.raw("run.bag"), self.raw("again.bag")
        self.assertGreater(len(first), 100)
        self.assertTrue(first == again)

    def test_warn_follows_on_and_says_so_once(self):
        self.begin("warn")
        state = self.follow(1.4, 0.8)
        self.assertGreater(state.nodes[-1].x, 1.3)
        status = self.diagnostics("simulation")
        self.assertEqual(status["level"], DiagnosticStatus.WARN)
        self.assertIn("rod 'rope', edge ", status["message"])
        self.assertIn("exceeds limits.strain = 0.2", status["message"])
        self.assertEqual(status["limits exceeded so far"], "1")
        self.assertEqual(self.warnings().count("exceeds limits.strain"), 1)
        self.follow(1.0, 0.8)
        wait_until(lambda: self.diagnostics("simulation")["level"] == DiagnosticStatus.OK,
                   what="the end of the excursion")

    def test_hold_stays_until_it_is_let_go_on(self):
        self.begin("hold")
        state = self.follow(1.4, 0.8)
        held = state.nodes[-1].x
        self.assertLess(held, 1.25)
        status = self.diagnostics("simulation")
        self.assertEqual(status["level"], DiagnosticStatus.ERROR)
        self.assertIn("call ~pause with false", status["message"])
        self.assertIn("until ~pause is called with false", self.warnings())
        state = self.follow(1.1, 0.6)
        self.assertEqual(state.nodes[-1].x, held)
        self.assertTrue(self.call("pause", SetBool, False).success)
        count = self.state.count()
        state = self.follow(1.1, 0.6)
        self.assertAlmostEqual(state.nodes[-1].x, 1.1, 3)
        wait_until(lambda: self.diagnostics("simulation")["level"] == DiagnosticStatus.OK, what="inputs that count")
        ends = [m.nodes[-1].x for m in self.state.all()[count - 1:]]
        self.assertLess(max(abs(a - b) for a, b in zip(ends, ends[1:])), 0.02)   # it catches up, and does not jump
        self.replayed()

    def test_release_lets_go_and_is_recorded(self):
        self.begin("release")
        stamp = self.follow(1.4, 0.8).header.stamp
        self.assertIn("is released, because a limit is exceeded", self.warnings())
        self.assertIn(False, [bool(a) for a in self.grasps.at(stamp).active])
        self.replayed()
        with rosbag.Bag(self.path("run.bag")) as bag:
            kinds = [message.kind for _, message, _ in bag.read_messages(topics=["/t/inputs"])
                     if message.text == "limit exceeded"]
        self.assertEqual(kinds, [9])

    def test_stop_fails_until_reset(self):
        self.begin("stop")
        message = self.follow(1.4, 0.8)
        self.assertIn("a limit is exceeded (on_limit: stop): rod 'rope', edge ", message)
        self.assertEqual(self.diagnostics("simulation")["level"], DiagnosticStatus.ERROR)
        self.assertTrue(self.call("reset", Trigger).success)
        wait_until(lambda: self.state.last().epoch == 1, what="the state after the reset")
        self.x = 1.0
        self.time = self.state.last().header.stamp.to_sec() - 0.005
        state = self.follow(1.1, 0.4)
        self.assertGreater(state.nodes[-1].x, 1.03)
        self.replayed()

    def test_an_outlier_is_faster_than_the_limit(self):
        self.begin("hold")
        before = self.follow(1.02, 0.3).nodes[-1].x
        self.x = 1.32   # one pose, 0.3 m off
        self.follow(1.32, 0.01)
        self.x = 1.02
        state = self.follow(1.02, 0.2)
        self.assertIn("the speed of its input ", self.warnings())
        self.assertLess(abs(state.nodes[-1].x - before), 0.15)


if __name__ == "__main__":
    run("limits_test", Limits)
