#!/usr/bin/python3
"""What moves grasps from outside: good and bad guides, tf, bodies, the motion player."""
import math

import rospy
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseArray, PoseStamped, Twist
from node_harness import SCENE, Listener, NodeCase, fill, pose, run, wait_until
from rosgraph_msgs.msg import Log
from slender_sim.msg import BodyStates, RodState
from tf2_msgs.msg import TFMessage
from geometry_msgs.msg import TransformStamped

NAN = float("nan")
RIGHT = "/t/grasps/right/pose"
BODY_SCENE = SCENE.replace("{topic: true}", "{body: cart}")


class Inputs(NodeCase):

    def end(self, listener, n=1):
        """Position of the right end after n steps."""
        p = self.states_after(listener, n).nodes[-1]
        return (p.x, p.y, p.z)

    def assert_near(self, a, b, tolerance=1e-9):
        self.assertLess(math.dist(a, b), tolerance, "%s is not near %s" % (a, b))

    def accepted(self, count=1):
        """Waits until the node has taken a guide in."""
        wait_until(lambda: self.diagnostics("inputs")["input age right [s]"] != "none yet", what="a guide")

    def test_guide_moves_the_grasp(self):
        self.start()
        state = self.listen("/t/state", RodState)
        guide = self.publisher(RIGHT, PoseStamped)
        self.assert_near(self.end(state), (1, 0, 1))
        # The gripper's frame is 2 m beside the rope: `attach: initial` keeps that.
        for k in range(21):
            guide.publish(pose(1, 2 + 0.005 * k, 1, 1.0 + 0.05 * k))
        self.arrived()
        self.assert_near(self.end(state, 250), (1, 0.1, 1))
        self.assertEqual(self.dropped("out_of_order"), 0)

    def test_silent_topics_are_named_once(self):
        log = Listener("/rosout", Log)
        self.start(pace="wall")
        note = "nobody has published a pose yet for grasp right (topic grasps/right/pose)"
        notes = lambda: [message for message in log.all() if note in message.msg]
        wait_until(notes, what="the note")
        reports = self.listen("/diagnostics", DiagnosticArray)
        wait_until(lambda: reports.count() > 2, what="further looks at the inputs")
        self.assertEqual(len(notes()), 1)

    def test_guides_move_all(self):
        self.start()
        state = self.listen("/t/state", RodState)
        guides = self.publisher("/t/guides", PoseArray)
        for k in range(11):
            message = PoseArray()
            message.header.frame_id = "world"
            message.header.stamp = rospy.Time.from_sec(1.0 + 0.05 * k)
            message.poses = [fill(pose(0, 0, 0).pose, (0, 0, 9)), fill(pose(0, 0, 0).pose, (1 - 0.01 * k, 0, 1))]
            guides.publish(message)
        self.arrived()
        last = self.states_after(state, 150)
        self.assert_near((last.nodes[-1].x, last.nodes[-1].y, last.nodes[-1].z), (0.9, 0, 1))
        self.assert_near((last.nodes[0].x, last.nodes[0].y, last.nodes[0].z), (0, 0, 1))   # fixed, whatever guides say

    def test_bad_guides_are_dropped_and_counted(self):
        self.start()
        state = self.listen("/t/state", RodState)
        guide = self.publisher(RIGHT, PoseStamped)
        guides = self.publisher("/t/guides", PoseArray)
        self.step(300)   # 2.5 s
        guide.publish(pose(NAN, 0, 1, 2.5))
        self.expect_drop("not_finite", 1)
        guide.publish(pose(1, 0, 1, 2.5, q=(0, 0, float("inf"), 1)))
        self.expect_drop("not_finite", 2)
        guide.publish(pose(1, 0, 1, 2.5, q=(0, 0, 0, 0)))
        self.expect_drop("bad_quaternion", 1)
        guide.publish(pose(1, 0, 1, 2.5, q=(0, 0, 0, 1.2)))
        self.expect_drop("bad_quaternion", 2)
        guide.publish(pose(1, 0, 1, 2.5, frame=""))
        self.expect_drop("bad_frame")
        guide.publish(pose(1, 0, 1, 2.5, frame="nowhere"))
        self.expect_drop("no_transform")
        guide.publish(pose(1, 0, 1, 1.2))
        self.expect_drop("stale")
        guide.publish(pose(1, 0, 1, 1e6))
        self.expect_drop("from_future")
        message = PoseArray()
        message.header.frame_id = "world"
        message.header.stamp = rospy.Time.from_sec(2.5)
        for count in (0, 1, 3):
            message.poses = [pose(0, 0, 0).pose] * count
            guides.publish(message)
        self.expect_drop("wrong_length", 3)
        message.poses = [pose(0, 0, 0).pose, pose(NAN, 0, 0).pose]
        guides.publish(message)
        self.expect_drop("not_finite", 3)
        self.assertEqual(self.diagnostics("inputs")["input age right [s]"], "none yet")
        self.assertEqual(int(self.diagnostics("inputs")["dropped"]), 12)
        self.assert_near(self.end(state), (1, 0, 1))
        self.assertIn("dropped", self.output("rod.out") + self.output("rod.err"))

    def test_stale_and_out_of_order_guides_keep_the_last(self):
        self.start()
        state = self.listen("/t/state", RodState)
        guide = self.publisher(RIGHT, PoseStamped)
        guide.publish(pose(1, 0, 1, 1.10))
        self.accepted()
        guide.publish(pose(5, 5, 5, 1.05))
        self.expect_drop("out_of_order", 1)
        guide.publish(pose(5, 5, 5, 1.10))
        self.expect_drop("out_of_order", 2)
        self.assert_near(self.end(state, 100), (1, 0, 1))

    def test_diagnostics_warn_after_a_drop(self):
        self.start(diagnostics_rate=2.0)
        guide = self.publisher(RIGHT, PoseStamped)
        reports = self.listen("/diagnostics", DiagnosticArray)   # all of them: the warning is in one
        levels = lambda: [status.level for report in reports.all() for status in report.status if status.name == "/t/rod: inputs"]
        guide.publish(pose(NAN, 0, 1, 1.0))
        wait_until(lambda: 1 in levels(), what="a warning")
        wait_until(lambda: levels()[-1] == 0, what="the warning to go")

    def transform(self, parent, child, p, q, stamp):
        message = TransformStamped()
        message.header.stamp = rospy.Time.from_sec(stamp)
        message.header.frame_id = parent
        message.child_frame_id = child
        message.transform.translation.x, message.transform.translation.y, message.transform.translation.z = p
        r = message.transform.rotation
        r.x, r.y, r.z, r.w = q
        return message

    def test_guide_in_another_frame(self):
        self.start(SCENE.replace(", attach: initial", ""), tf_timeout=60.0)
        state = self.listen("/t/state", RodState)
        guide = self.publisher(RIGHT, PoseStamped)
        tf = self.publisher("/tf", TFMessage)
        # The tool frame hangs at (1, 0.05, 1), turned by 90 degrees about z: its x axis is the world's y.
        half = math.sqrt(0.5)
        guide.publish(pose(-0.05, 0, 0, 1.2, frame="tool", q=(0, 0, -half, half)))   # comes before its transform
        self.arrived()
        self.assertEqual(self.diagnostics("inputs")["input age right [s]"], "none yet")
        tf.publish(TFMessage([self.transform("world", "tool", (1, 0.05, 1), (0, 0, half, half), 1.1)]))
        tf.publish(TFMessage([self.transform("world", "tool", (1, 0.15, 1), (0, 0, half, half), 1.3)]))
        self.accepted()
        # at its own stamp the tool is half way between: (1, 0.10, 1), so the gripper is at (1, 0.05, 1)
        self.assert_near(self.end(state, 200), (1, 0.05, 1))
        self.assertEqual(self.dropped("no_transform"), 0)

    def test_unknown_frames_hold_back_nothing_else(self):
        self.start(tf_timeout=100.0)
        state = self.listen("/t/state", RodState)
        guide = self.publisher(RIGHT, PoseStamped)
        for k in range(300):
            guide.publish(pose(1, 0, 1, 1.0 + 1e-4 * k, frame="nowhere"))
        self.expect_drop("queue_full", 50)   # a quarter of 1,000 may wait
        guide.publish(pose(1, 0, 1, 1.1))
        guide.publish(pose(1, 0.1, 1, 1.2))
        self.arrived()
        self.assert_near(self.end(state, 200), (1, 0.1, 1))
        self.assertEqual(int(self.diagnostics("inputs")["dropped"]), 50)

    def test_body_drives_a_grasp(self):
        self.start(BODY_SCENE)
        state = self.listen("/t/state", RodState)
        bodies = self.publisher("/t/bodies", BodyStates)
        half = math.sqrt(0.5)
        for k in range(11):
            message = BodyStates()
            message.header.frame_id = "world"
            message.header.stamp = rospy.Time.from_sec(1.0 + 0.05 * k)
            message.name = ["cart"]
            # turns by 90 degrees about the vertical axis through (0.9, 0, 1), 0.1 m from the held end
            angle = math.pi / 2 * k / 10
            message.pose = [fill(pose(0, 0, 0).pose, (0.9, 0, 1), (0, 0, math.sin(angle / 2), math.cos(angle / 2)))]
            message.twist = [Twist()]
            bodies.publish(message)
        self.arrived()
        self.assert_near(self.end(state, 150), (0.9, 0.1, 1))
        message.twist = [Twist(), Twist()]
        bodies.publish(message)
        self.expect_drop("wrong_length")
        message.twist = []
        message.name = ["tree"]
        bodies.publish(message)
        self.expect_drop("unknown_name")
        message.name = ["cart"]
        message.pose[0].position.x = NAN
        bodies.publish(message)
        self.expect_drop("not_finite")

    def test_player_through_tf(self):
        table = self.path("motion.csv")
        with open(table, "w") as file:
            file.write("# lifted by 0.1 m\nt,body,x,y,z,qx,qy,qz,qw\n")
            for k in range(21):
                s = k / 20.0
                file.write("%g,hand,3,2,%.6f,0,0,0,1\n" % (s, 0.1 * s * s * (3 - 2 * s)))
        # a busy machine may keep messages for a while
        self.start(pace="wall", guide_delay=3.0, guide_timeout=10.0, tf_timeout=10.0)
        state = self.listen("/t/state", RodState)
        player = self.launch("motion_player", "player", {"file": table, "bodies": {"hand": "right"}})
        self.assertEqual(player.wait(100), 0, self.output("player.err"))
        wait_until(lambda: abs(state.last().nodes[-1].z - 1.1) < 1e-6, what="the end to be lifted")
        # smooth on the way: no step moves it faster than the cubic does (0.15 m/s), nor back
        track = [(m.header.stamp.to_sec(), m.nodes[-1].z) for m in state.all()]
        speeds = [(z - y) / (t - s) for (s, y), (t, z) in zip(track, track[1:])]
        self.assertLess(max(speeds), 0.2)
        self.assertGreater(min(speeds), -0.002)
        self.assertEqual(int(self.diagnostics("inputs")["dropped"]), 0)

    def test_player_refuses_bad_parameters(self):
        table = self.path("motion.csv")
        with open(table, "w") as file:
            file.write("0,hand,0,0,0,0,0,0,1\n0,head,0,0,0,0,0,0,1\n")
        for k, (expected, parameters) in enumerate((("~lop: no such parameter", {"lop": True}), ("~speed: is 0, must be", {"speed": 0}),
                                                    ("foot is not in", {"bodies": {"foot": "right"}}), ("are: hand, head", {"solids": ["foot"]}),
                                                    ("~offset", {"offset": [1, 2]}), ("~loop", {"loop": "perhaps"}))):
            player = self.launch("motion_player", "player%d" % k, dict(parameters, file=table))
            self.assertEqual(player.wait(60), 2)
            self.assertIn(expected, self.output("player%d.err" % k))

    def test_fairing_node_has_no_parameters(self):
        self.assertEqual(self.launch("fairing_node", "fairing", {"x": 1}).wait(60), 2)
        self.assertIn("~x: no such parameter", self.output("fairing.err"))

    def test_player_refuses_a_bad_table(self):
        table = self.path("motion.csv")
        with open(table, "w") as file:
            file.write("0,hand,0,0,zero,0,0,0,1\n")
        player = self.launch("motion_player", "player", {"file": table})
        self.assertEqual(player.wait(60), 2)
        self.assertIn("motion.csv:1", self.output("player.err"))


if __name__ == "__main__":
    run("inputs_test", Inputs)
