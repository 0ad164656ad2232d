#!/usr/bin/python3
"""~interactive: what is dragged by hand moves as by messages of its own."""
import math

import rospy
from slender_sim.msg import BodyStates, RodState
from std_srvs.srv import Trigger
from slender_sim.srv import SetGrasp, SetGraspRequest
from visualization_msgs.msg import InteractiveMarkerFeedback

from hand_harness import HandCase, dragged
from node_harness import SCENE, run, wait_until

STEP = 0.005
BODIES = SCENE + """
bodies:
  - {name: paddle, shape: {box: {size: [0.1, 0.2, 0.02]}}, pose: {position: [0, 1, 0]}, motion: {topic: true}}
  - {name: stone, mass: 1, inertia: [1, 1, 1], pose: {position: [0, 2, 0]}}
obstacles:
  - {name: ball, shape: {sphere: {radius: 0.1}}, pose: {position: [0, 3, 0]}, motion: {topic: true}}
  - {name: wall, shape: {sphere: {radius: 0.1}}, pose: {position: [0, 4, 0]}}
"""


class Hand(HandCase):

    def begin(self, scene=SCENE):
        super().begin(scene, RodState)

    def test_only_what_messages_move_has_handles(self):
        self.begin(BODIES)
        wait_until(lambda: self.shown.count() and len(self.shown.last().markers) == 3, what="three handles")
        handles = self.handles()
        self.assertEqual(set(handles), {"grasps/right", "bodies/paddle", "bodies/ball"})
        self.assertEqual(handles["bodies/ball"].header.frame_id, "world")
        self.assertTrue(handles["bodies/ball"].header.stamp.is_zero())
        self.assertAlmostEqual(handles["bodies/ball"].pose.position.y, 3.0)
        self.assertEqual(len(handles["grasps/right"].controls), 7)
        self.assertAlmostEqual(handles["grasps/right"].scale, 0.08, places=6)   # of a rope of 1 m and a radius of 4 mm
        ball = handles["grasps/right"].controls[-1].markers[0].scale.x
        self.assertAlmostEqual(ball, 0.02)                                      # it does not hide the rope

    def test_without_it_nothing_is_advertised(self):
        self.start()
        names = [name for name, _ in rospy.get_published_topics("/t")]
        self.assertNotIn("/t/interactive/update", names)

    def test_drags_a_grasp(self):
        self.begin()
        start = self.after(1)
        self.drag_by("grasps/right", 0, 0, 0, event=InteractiveMarkerFeedback.MOUSE_DOWN)
        self.after(2)
        self.drag_by("grasps/right", -0.1, 0.2, 0)
        fastest, before = 0.0, start.nodes[-1]
        for _ in range(80):
            now = self.after(1).nodes[-1]
            fastest = max(fastest, math.dist((now.x, now.y, now.z), (before.x, before.y, before.z)) / STEP)
            before = now
        self.assertAlmostEqual(before.x - start.nodes[-1].x, -0.1, delta=1e-6)   # attach: initial, as where the hand took hold
        self.assertAlmostEqual(before.y - start.nodes[-1].y, 0.2, delta=1e-6)
        self.assertGreater(fastest, 0.5)
        self.assertLess(fastest, 1.6)       # catches up at 1 m/s on average: 1.5 at most
        self.assertEqual(int(self.diagnostics("inputs")["dropped"]), 0)

    def test_quick_hand_between_two_steps(self):
        """A burst within one step: the last counts, nothing is dropped."""
        self.begin()
        start = self.after(1).nodes[-1]
        p, q = self.beside("grasps/right", 0, 0, 0)
        for k in range(1, 21):
            self.hand.publish(dragged("grasps/right", (p[0], p[1] + 0.01 * k, p[2]), q))
        self.arrived()
        end = self.after(100).nodes[-1]
        self.assertAlmostEqual(end.y - start.y, 0.2, delta=1e-6)
        self.assertEqual(int(self.diagnostics("inputs")["dropped"]), 0)

    def test_bodies_and_reset(self):
        self.begin(BODIES)
        bodies = self.listen("/t/body_states", BodyStates)
        self.drag("bodies/paddle", (0.2, 1.0, 0.3), q=(0, 0, math.sin(0.25), math.cos(0.25)))
        told = bodies.at(self.after(120).header.stamp)
        paddle = told.pose[told.name.index("paddle")]
        self.assertAlmostEqual(paddle.position.x, 0.2, delta=1e-6)
        self.assertAlmostEqual(paddle.position.z, 0.3, delta=1e-6)
        self.assertAlmostEqual(paddle.orientation.z, math.sin(0.25), delta=1e-6)
        wait_until(lambda: abs(self.handles()["bodies/paddle"].pose.position.x - 0.2) < 1e-9, what="the handle where the hand left it")
        self.assertTrue(self.call("reset", Trigger).success)
        wait_until(lambda: abs(self.handles()["bodies/paddle"].pose.position.x) < 1e-9, what="the handle where the body is again")

    def test_taken_up_where_it_was_attached_anew(self):
        self.begin()
        self.drag_by("grasps/right", 0, 0.1, 0)
        self.after(80)
        self.assertTrue(self.call("set_grasp", SetGrasp, SetGraspRequest(name="right", action=SetGraspRequest.RELEASE)).success)
        wait_until(lambda: not self.handles(), what="no handle of a released grasp")
        self.after(20)
        answer = self.call("set_grasp", SetGrasp, SetGraspRequest(name="right", action=SetGraspRequest.ATTACH_NODES, first_node=-1, last_node=-1))
        self.assertTrue(answer.success, answer.message)
        wait_until(lambda: len(self.handles()) == 1, what="its handle")
        start = self.after(1).nodes[-1]
        self.drag_by("grasps/right", 0, 0, 0.1)
        end = self.after(80).nodes[-1]
        self.assertAlmostEqual(end.x, start.x, delta=1e-6)
        self.assertAlmostEqual(end.z - start.z, 0.1, delta=1e-6)

    def test_bad_feedback(self):
        self.begin()
        self.drag("grasps/left", (0, 0, 0))              # fixed
        self.expect_drop("unknown_name")
        self.drag("grasps/right", (float("nan"), 0, 0))
        self.expect_drop("not_finite")
        self.drag("grasps/right", (0, 0, 0), q=(0, 0, 0, 2))
        self.expect_drop("bad_quaternion")
        self.assertEqual(self.after(5).step, 5)


if __name__ == "__main__":
    run("hand", Hand)
