#!/usr/bin/python3
"""Rigid bodies and obstacles: driven by messages, and told about."""
import math
import time

import rosbag
import rospy
from geometry_msgs.msg import Twist, WrenchStamped
from node_harness import SCENE, NodeCase, fill, pose, run, wait_until
from slender_sim.msg import BodyStates, RodState
from slender_sim.srv import SetGrasp, SetGraspRequest
from std_srvs.srv import Trigger
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import MarkerArray

ROPE = SCENE.replace("      right: {edges: [-1], motion: {topic: true}, attach: initial}\n", "")
CART_AND_BALL = ROPE + """
    broadcast_tf: {tip: -1}
bodies:
  - {name: cart, motion: {topic: true}, pose: {position: [1.1, 0, 1]}, welds: [{rod: rope, edge: -1}], shape: {box: {size: [0.2, 0.1, 0.1]}}}
  - {name: ball, mass: 2, shape: {sphere: {radius: 0.05}}, pose: {position: [5, 0, 2]}, velocity: {linear: [1, 0, 0], angular: [0, 0, 2]},
     broadcast_tf: true}
"""
PUSHED = SCENE.replace("motion: {topic: true}", "motion: fixed") + """
    contact: {friction: 0.2}
obstacles:
  - {name: fist, shape: {sphere: {radius: 0.05}}, pose: {position: [0.5, 0, 0.7]}, motion: {topic: true}}
  - {name: floor, shape: {plane: {}}}
"""
FOLLOWED = SCENE.replace("{topic: true}", "{body: crane}") + """
bodies: [{name: crane, motion: {topic: true}, pose: {position: [1, 0, 2]}}]
"""


def bodies(name, position, stamp, q=(0, 0, 0, 1)):
    message = BodyStates()
    message.header.frame_id = "world"
    message.header.stamp = rospy.Time.from_sec(stamp)
    message.name = [name]
    message.pose = [fill(pose(0, 0, 0).pose, position, q)]
    return message


class Bodies(NodeCase):

    def drive(self, name, start, end, seconds, turn=0.0):
        """Sends the way from start to end, from 1 s on, and waits until all has come."""
        publisher = self.publisher("/t/bodies", BodyStates)
        n = 20
        for k in range(n + 1):
            s = k / float(n)
            u = s * s * (3 - 2 * s)
            p = [a + u * (b - a) for a, b in zip(start, end)]
            angle = turn * u
            publisher.publish(bodies(name, p, 1.0 + seconds * s, (0, 0, math.sin(angle / 2), math.cos(angle / 2))))
        self.arrived()
        return publisher

    def test_body_drags_a_welded_rod_and_the_reaction_arrives(self):
        self.start(CART_AND_BALL)
        state = self.listen("/t/state", RodState)
        wrench = self.listen("/t/grasps/left/wrench", WrenchStamped)
        told = self.listen("/t/body_states", BodyStates)
        before = wrench.at(self.step(2).stamp).wrench.force.x
        self.drive("cart", (1.1, 0, 1), (1.15, 0, 1), 0.5)
        stamp = self.step(300).stamp
        last = state.at(stamp).nodes[-1]
        self.assertLess(math.dist((last.x, last.y, last.z), (1.05, 0, 1)), 1e-9)
        # E A times the strain of 5 %, and a little from the sag
        self.assertGreater(wrench.at(stamp).wrench.force.x - before, 2.0)
        self.assertLess(wrench.at(stamp).wrench.force.x, 3.5)
        self.assertEqual(told.at(stamp).name, ["cart", "ball"])
        self.assertAlmostEqual(told.at(stamp).pose[0].position.x, 1.15, places=9)

    def test_welds_turn_with_their_body(self):
        self.start(CART_AND_BALL)
        state = self.listen("/t/state", RodState)
        self.drive("cart", (1.1, 0, 1), (1.1, 0, 1), 0.5, turn=math.pi / 2)
        last = self.states_after(state, 150).nodes[-1]
        self.assertLess(math.dist((last.x, last.y, last.z), (1.1, -0.1, 1)), 1e-9)   # 0.1 m off the cart's middle

    def test_free_body_flies(self):
        self.start(CART_AND_BALL)
        told = self.listen("/t/body_states", BodyStates)
        tf = self.listen("/tf", TFMessage)
        state = self.listen("/t/state", RodState)
        stamp = self.step(100).stamp   # 0.5 s
        ball, twist = told.at(stamp).pose[1], told.at(stamp).twist[1]
        h = 0.005
        self.assertAlmostEqual(ball.position.x, 5.5, places=9)
        self.assertLess(abs(ball.position.z - (2 - 0.5 * 9.81 * 0.25)), 9.81 * 0.5 * h)   # implicit Euler is of first order
        self.assertLess(abs(twist.linear.z + 9.81 * 0.5), 1e-9)
        self.assertAlmostEqual(twist.angular.z, 2.0, places=6)
        self.assertAlmostEqual(2 * math.atan2(ball.orientation.z, ball.orientation.w), 1.0, places=6)
        wait_until(lambda: tf.last().transforms[0].header.stamp == stamp, what="tf")
        frames = tf.last().transforms
        self.assertEqual([(t.header.frame_id, t.child_frame_id) for t in frames],
                         [("world", "ball"), ("world", "t/rod/grasps/left"),
                          ("world", "t/rod/rods/rope/tip")])
        tip, q = frames[2].transform.translation, frames[2].transform.rotation
        before, end = state.at(stamp).nodes[-2:]
        self.assertEqual((tip.x, tip.y, tip.z), (end.x, end.y, end.z))
        tangent = (1 - 2 * (q.y**2 + q.z**2), 2 * (q.x * q.y + q.w * q.z), 2 * (q.x * q.z - q.w * q.y))
        edge = (end.x - before.x, end.y - before.y, end.z - before.z)
        self.assertLess(math.dist(tangent, [e / math.hypot(*edge) for e in edge]), 1e-12)   # a naturally straight rope
        self.assertEqual(frames[0].transform.translation.z, ball.position.z)
        # back at the start
        self.assertTrue(self.call("reset", Trigger).success)
        wait_until(lambda: told.last().pose[1].position.x == 5.0, what="the reset")

    def test_obstacle_pushes_a_rod(self):
        self.start(PUSHED)
        state = self.listen("/t/state", RodState)
        self.drive("fist", (0.5, 0, 0.7), (0.5, 0, 1.0), 1.0)
        middle = self.states_after(state, 250).nodes[10]
        self.assertGreater(middle.z, 1.05 + 0.004 - 1e-9)   # on top of the ball
        self.assertLess(middle.z, 1.07)

    def test_grasp_follows_a_body_of_the_scene(self):
        self.start(FOLLOWED)
        state = self.listen("/t/state", RodState)
        self.drive("crane", (1, 0, 2), (0.9, 0, 2.1), 0.5)
        last = self.states_after(state, 150).nodes[-1]
        self.assertLess(math.dist((last.x, last.y, last.z), (0.9, 0, 1.1)), 1e-9)

    def test_a_body_that_is_unheard_is_warned_of_until_it_is_heard(self):
        self.start(FOLLOWED)
        warning = "nobody has published a pose yet of crane"
        said = lambda: (self.output("rod.out") + self.output("rod.err")).count(warning)
        wait_until(lambda: said() == 1, what="the warning")
        wait_until(lambda: said() == 2, what="the warning once more")   # after ten seconds
        self.drive("crane", (1, 0, 2), (0.9, 0, 2.1), 0.5)
        self.step(1)
        heard = said()
        begin = time.time()
        wait_until(lambda: time.time() > begin + 12.0, what="a while in which the warning would come again")
        self.assertEqual(said(), heard)

    def test_a_grasp_attached_elsewhere_stays_there(self):
        """Also where its body says `attach: section`."""
        self.start(FOLLOWED.replace(", attach: initial", "").replace("[1, 0, 2]", "[1, 0, 1]"))
        state = self.listen("/t/state", RodState)
        self.step(5)
        set_grasp = lambda action, node=0: self.call("set_grasp", SetGrasp, SetGraspRequest(
            name="right", action=action, first_node=node, last_node=node))
        self.assertTrue(set_grasp(SetGraspRequest.RELEASE).success)
        fallen = self.states_after(state, 60).nodes[10]
        self.assertTrue(set_grasp(SetGraspRequest.ATTACH_NODES, 10).success)
        held = self.states_after(state, 5).nodes[10]
        self.assertLess(math.dist((held.x, held.y, held.z), (fallen.x, fallen.y, fallen.z)), 1e-9)

    def test_bad_bodies_are_dropped_and_counted(self):
        self.start(CART_AND_BALL)
        state = self.listen("/t/state", RodState)
        publisher = self.publisher("/t/bodies", BodyStates)
        publisher.publish(bodies("ball", (0, 0, 0), 1.0))   # simulated: nobody moves it
        publisher.publish(bodies("", (0, 0, 0), 1.0))
        self.expect_drop("unknown_name", 2)
        publisher.publish(bodies("cart", (float("nan"), 0, 0), 1.0))
        self.expect_drop("not_finite")
        message = bodies("cart", (0, 0, 0), 1.0)
        message.twist = [Twist(), Twist()]
        publisher.publish(message)
        self.expect_drop("wrong_length")
        publisher.publish(bodies("cart", (0, 0, 0), 1.0, (0, 0, 0, 0)))
        self.expect_drop("bad_quaternion")
        message = bodies("cart", (0, 0, 0), 1.0)
        message.name, message.pose = 2 * message.name, 2 * message.pose   # which of them?
        publisher.publish(message)
        self.expect_drop("wrong_length", 2)
        last = self.states_after(state, 20).nodes[-1]
        self.assertLess(math.dist((last.x, last.y, last.z), (1, 0, 1)), 1e-9)

    def test_bodies_are_drawn_and_recorded(self):
        bag = self.path("out.bag")
        node = self.start(CART_AND_BALL, record_bag=bag)
        markers = self.listen("/t/markers", MarkerArray)
        self.step(3)
        wait_until(lambda: markers.count() > 0, what="markers")
        drawn = {(m.ns, m.id): m for m in markers.last().markers}
        self.assertAlmostEqual(max(p.x for p in drawn["bodies", 0].points), 0.1)
        self.assertAlmostEqual(drawn["bodies", 1].scale.x, 0.1)
        node.terminate()
        self.assertEqual(node.wait(60), 0)
        with rosbag.Bag(bag) as file:
            told = [m for _, m, _ in file.read_messages("/t/body_states")]
        self.assertEqual(len(told), 4)
        self.assertGreater(told[-1].pose[1].position.x, told[0].pose[1].position.x)


if __name__ == "__main__":
    run("bodies_test", Bodies)
