#!/usr/bin/python3
"""What follows frames of tf, and the frames that a node broadcasts."""
import math

import rosbag
import rospy
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped, TransformStamped
from rosgraph_msgs.msg import Log
from slender_sim.msg import BodyStates, ClothState, GraspStates, RodState, ThreadState
from std_srvs.srv import Trigger
from tf2_msgs.msg import TFMessage

from node_harness import NodeCase, numbers, pose, run, status_of, wait_until

SCENE = """
name: beside_a_robot
gravity: [0, 0, 0]
time: {step: 0.005, integrator: implicit_euler}
rods:
  - name: rope
    centerline: {straight: {from: [0, 0, 1], to: [1, 0, 1], edges: 20}}
    director: [0, 1, 0]
    cross_section: {radius: 0.004}
    material: {density: 1100, youngs_modulus: 1.0e6, poissons_ratio: 0.45}
    damping: {mass: 2.0}
    contact: {friction: 0.3}
    grasps:
      left: {edges: [0], motion: {topic: true}}
      right: {edges: [-1], motion: {tf: tool0, offset: {position: [0, 0, -0.1]}}}
obstacles:
  - {name: link, shape: {box: {size: [0.1, 0.1, 0.1]}}, pose: {position: [1, 3, 1.1]},
     motion: {tf: tool0, offset: {position: [0, 3, 0]}}}
  - {name: table, shape: {box: {size: [0.1, 0.1, 0.1]}}, pose: {position: [0, 5, 0]}, motion: {tf: table}}
bodies:
  - {name: cart, shape: {sphere: {radius: 0.1}}, pose: {position: [0, 7, 0]}, motion: {tf: slow}}
  - {name: ball, mass: 1, inertia: [1, 1, 1], pose: {position: [0, 9, 0]}}
"""


def transform(parent, child, p, stamp, turn=0.0):
    message = TransformStamped()
    message.header.stamp = rospy.Time.from_sec(stamp)
    message.header.frame_id = parent
    message.child_frame_id = child
    message.transform.translation.x, message.transform.translation.y, message.transform.translation.z = p
    message.transform.rotation.z, message.transform.rotation.w = math.sin(0.5 * turn), math.cos(0.5 * turn)
    return message


def place(pose):
    return pose.position.x, pose.position.y, pose.position.z


def swing(t):
    """Where the tool is, at first at (1, 0, 1.1), and at rest there."""
    return 1 - 0.05 * (1 - math.cos(3 * t)), 0.05 * (1 - math.cos(2 * t)), 1.1


class Tf(NodeCase):

    def follow(self, **parameters):
        self.start(SCENE, **parameters)
        self.obstacles = self.listen("/t/obstacle_states", BodyStates)
        self.grasps = self.listen("/t/grasp_states", GraspStates)
        self.bodies = self.listen("/t/body_states", BodyStates)
        self.tf = self.publisher("/tf", TFMessage)

    def now(self, stamp):
        """Grasp, link, table and cart at the same instant."""
        obstacles, grasps, bodies = [listener.at(stamp) for listener in (self.obstacles, self.grasps, self.bodies)]
        return place(grasps.pose[1]), place(obstacles.pose[0]), place(obstacles.pose[1]), place(bodies.pose[0])

    def heard(self, *frames):
        """Steps until the node has heard of these frames."""
        def all_heard():
            self.step(1)
            values = self.diagnostics("inputs")
            ages = {frame: [value for key, value in values.items()
                            if key.startswith("input age") and "(tf %s)" % frame in key]
                    for frame in frames}
            self.assertTrue(all(ages.values()), values)   # all of them are followed
            return all(value != "none yet" for some in ages.values() for value in some)
        wait_until(all_heard, what="the frames")

    def test_frames_are_followed_with_one_lag(self):
        """A robot's base turns by 0.3 rad; its tool swings, and is known ahead."""
        self.follow(guide_delay=0.05)
        c, s = math.cos(0.3), math.sin(0.3)
        def in_base(p):
            return c * p[0] + s * p[1], -s * p[0] + c * p[1], p[2]
        instants = range(450)   # nine seconds: tf forgets what is older than ten
        messages = [transform("base", "tool0", in_base(swing(0.02 * k)), 1 + 0.02 * k, turn=-0.3) for k in instants]
        messages += [transform("world", "base", (0, 0, 0), 1 + 0.02 * k, turn=0.3) for k in instants]
        self.tf.publish(TFMessage(messages))
        self.heard("tool0")
        self.step(40)   # what was late at the start has caught up
        worst = 0.0
        for _ in range(10):
            stamp = self.step(20).stamp
            grasp, link, table, cart = self.now(stamp)
            expected = swing(stamp.to_sec() - 1 - 0.05)
            worst = max(worst, math.dist(grasp, (expected[0], expected[1], 1.0)))
            # rigid, to the last digits: both are in the same frame at the same instant
            self.assertLess(math.dist(link, (grasp[0], grasp[1] + 3, grasp[2] + 0.1)), 1e-12)
            self.assertEqual(table, (0, 5, 0))   # nobody speaks of its frame
            self.assertEqual(cart, (0, 7, 0))
        # tf interpolates poses of 50 Hz linearly: 0.5 m/s^2 * (0.02 s)^2 / 8, and the error of the cubic
        self.assertLess(worst, 1e-4)

    def test_late_frames_make_all_inputs_late(self):
        """slow comes 0.15 s after its stamps, tool0 and the messages in time: all are shown at one instant."""
        self.follow(guide_delay=0.05, pace="wall")
        left = self.publisher("/t/grasps/left/pose", PoseStamped)
        reports = self.listen("/diagnostics", DiagnosticArray)
        start = rospy.get_time()
        rate = rospy.Rate(50)
        late = []
        way = lambda t: 0.03 * math.sin(2 * t)

        def lags():
            values = status_of(reports.last(), "inputs")
            return [float(values["input lag %s [s]" % key]) for key in ("left", "right (tf tool0)", "cart (tf slow)")]

        def gaps():
            """How far the others are from the cart, in the last second."""
            last = [{message.header.stamp: message.pose for message in listener.all()[-200:]}
                    for listener in (self.grasps, self.obstacles, self.bodies)]
            common = [[poses[stamp] for poses in last] for stamp in last[0] if stamp in last[1] and stamp in last[2]]
            return [max(abs(x - bodies[0].position.x)
                        for x in (grasps[0].position.x, grasps[1].position.x - 1, obstacles[0].position.x - 1))
                    for grasps, obstacles, bodies in common]

        for k in range(3000):
            now = rospy.get_time()
            late.append(now)
            left.publish(pose(way(now - start), 0, 1, now))
            self.tf.publish(TFMessage([transform("world", "tool0", (1 + way(now - start), 0, 1.1), now)]))
            if late[0] < now - 0.15:
                then = late.pop(0)
                self.tf.publish(TFMessage([transform("world", "slow", (way(then - start), 7, 0), then)]))
            rate.sleep()
            if k < 299 or k % 20 != 19:
                continue
            lag, gap = lags(), gaps()
            if max(lag) - min(lag) < 5e-3 and max(gap, default=1.0) < 5e-4:
                break   # after six seconds; later if the machine was busy, so that other inputs came late as well
        self.assertGreater(lag[0], 0.15)
        self.assertLess(max(lag) - min(lag), 5e-3, lag)   # they approach it
        self.assertGreater(len(gap), 50)
        # in 0.1 s, by which one is later than the other, they move by up to 6 mm
        self.assertLess(max(gap), 5e-4)

    def test_static_frames(self):
        self.follow(guide_delay=0.05)
        self.stand("table", (0, 5.2, 0))
        self.heard("table")
        grasp, link, table, cart = self.now(self.step(200).stamp)   # 0.2 m at 1 m/s
        self.assertLess(math.dist(table, (0, 5.2, 0)), 1e-9)
        self.assertEqual(link, (1, 3, 1.1))
        # it does not grow old
        self.assertLess(float(self.diagnostics("inputs")["input age table (tf table) [s]"]), 0.1)

    def stand(self, frame, place, turn=0.0, parent="world"):
        """A frame of tf that never moves."""
        static = rospy.Publisher("/tf_static", TFMessage, queue_size=10, latch=True)
        self.ends.append(static)
        static.publish(TFMessage([transform(parent, frame, place, 0, turn)]))

    def test_a_guide_rides_on_a_frame(self):
        """At an offset it goes there; with attach: initial it stays where it is, and the frame may be anywhere."""
        shell = """
name: flap
gravity: [0, 0, 0]
time: {step: 0.01}
tracked:
  - {name: flap, guide: {grid: {corner: [0, 0, 0], sides: [[0.2, 0, 0], [0, 0.2, 0]], cells: 2}, motion: %s},
     mesh: same,
     material: {area_density: 0.2, thickness: 0.0005, youngs_modulus: 2.0e5}, test_functions: {clusters: {count: 1}}}
"""
        rope = """
name: flap
gravity: [0, 0, 0]
time: {step: 0.01}
rods:
  - {name: rope, centerline: {straight: {from: [0, 0, 0], to: [0.2, 0, 0], edges: 8}}, cross_section: {radius: 0.005},
     track: {guide: {nodes: 3, motion: %s}}}
"""
        offset = "{tf: hand, offset: {position: [0.1, 0, 0]}}"
        for scene, motion, corner in ((shell, offset, (1, 0.1, 2)), (shell, "{tf: hand}", (0, 0, 0)),
                                      (rope, offset, (1, 0.1, 2)), (rope, "{tf: hand}", (0, 0, 0))):
            self.start(scene % motion, program="tracking_node", guide_delay=0.05)
            state = self.listen("/t/state", ClothState if scene == shell else RodState)
            self.stand("hand", (1, 0, 2), turn=math.pi / 2)
            self.heard("hand")
            last = self.states_after(state, 400)   # 2.2 m at 1 m/s
            first, second = (last.guide_vertices if scene == shell else last.guide_nodes)[:2]
            self.assertLess(math.dist((first.x, first.y, first.z), corner), 1e-9)
            side = (0, 0.1, 0) if corner[0] else (0.1, 0, 0)   # turned with the frame
            self.assertLess(math.dist((second.x - first.x, second.y - first.y, second.z - first.z), side), 1e-9)
            self.tearDown()
            self.setUp()

    def test_a_nozzle_follows_a_frame(self):
        self.start("""
name: honey
time: {step: 0.002}
threads:
  - name: honey
    fluid: {density: 1400, viscosity: 20, surface_tension: 0.05}
    nozzle: {position: [0, 0, 0.03], diameter: 0.005, flow: 6.0e-7,
             motion: {tf: flange, offset: {rpy: [0, 1.5707963267948966, 0]}}}
    floor: {height: 0}
    edges: {feed: 0.002, longest: 0.003, shortest: 0.0006, deposited: 25}
""", program="thread_node", guide_delay=0.05)
        state = self.listen("/t/state", ThreadState)
        self.stand("flange", (0.01, 0, 0.03))
        self.heard("flange")
        node = self.states_after(state, 150).nodes[-1]
        self.assertLess(math.dist((node.x, node.y, node.z), (0.01, 0, 0.03)), 1e-6)

    def test_frames_that_never_come(self):
        self.start(SCENE, pace="wall", guide_timeout=0.5, guide_delay=0.05)
        wait_until(lambda: "no input yet for right (tf tool0)" in self.diagnostics("inputs")["message"],
                   what="the warning")
        values = self.diagnostics("inputs")
        self.assertEqual(values["level"], 1)
        self.assertIn("tool0", values["tf tool0"])   # what tf says of it
        wait_until(lambda: "tf has no pose yet of the frame tool0, which grasp right, obstacle link follows" in
                   self.output("rod.out") + self.output("rod.err"), what="the reminder")

    def test_loops_are_refused(self):
        for frame in ("t/rod/grasps/left", "ball"):
            node = self.start(SCENE, wait=False, set=["rods.0.grasps.right.motion={tf: %s}" % frame])
            self.assertEqual(node.wait(60), 2)
            self.assertIn("grasp right follows the frame %s of tf, which this node broadcasts itself" % frame,
                          self.output("rod.err"))

    def test_a_frame_behind_an_own_frame(self):
        """The tool hangs on the grasp that follows it."""
        self.follow(guide_delay=0.05)
        log = self.listen("/rosout", Log)   # notes in a file of output come late
        self.stand("tool0", (0, 0, 0.1), parent="t/rod/grasps/right")
        self.heard("tool0")
        wait_until(lambda: any("the frame tool0 of tf has come" in message.msg for message in log.all()),
                   what="the note")
        wait_until(lambda: "a descendant of t/rod/grasps/right, which this node broadcasts" in
                   self.output("rod.out") + self.output("rod.err"), what="the warning")

    def test_a_run_is_repeated_bit_by_bit(self):
        node = self.start(SCENE, pace="wall", guide_delay=0.05, record_bag=self.path("run.bag"))
        self.tf = self.publisher("/tf", TFMessage)
        rate = rospy.Rate(50)
        start = rospy.get_time()
        def move(seconds):
            for _ in range(int(50 * seconds)):
                now = rospy.get_time()
                self.tf.publish(TFMessage([transform("world", "tool0", swing(now - start), now)]))
                rate.sleep()
        move(1.5)
        self.assertTrue(self.call("reset", Trigger).success)
        move(1.0)
        node.terminate()
        self.assertEqual(node.wait(60), 0, self.output("rod.err"))
        node = self.start("", wait=False, pace="fast", replay=self.path("run.bag"), record_bag=self.path("again.bag"))
        self.assertEqual(node.wait(200), 0, self.output("rod.err"))
        def states(bag):
            return [(m.header.stamp, numbers(m))
                    for _, m, _ in rosbag.Bag(self.path(bag)).read_messages(topics=["/t/state"])]
        first, again = states("run.bag"), states("again.bag")
        self.assertGreater(len(first), 200)
        # it moved
        self.assertGreater(max(abs(state[1][-1] - first[0][1][-1]) + abs(state[1][3 * 20 + 1]) for state in first),
                           0.01)
        self.assertEqual(first, again)


if __name__ == "__main__":
    run("tf_test", Tf)
