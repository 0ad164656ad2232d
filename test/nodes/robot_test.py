#!/usr/bin/python3
"""Links of a robot from the parameter server follow tf; what is missing is refused; a bag holds the whole robot."""
import math
import os
import subprocess

import rosbag
import rospy
from geometry_msgs.msg import TransformStamped
from node_harness import NodeCase, run, wait_until
from sensor_msgs.msg import JointState
from slender_sim.msg import BodyStates
from slender_sim.srv import SetGrasp
from tf2_msgs.msg import TFMessage

URDF = """<robot name="arm">
  <link name="base"><collision><geometry><box size="0.1 0.1 0.1"/></geometry></collision></link>
  <link name="arm">
    <collision><origin xyz="0.2 0 0"/><geometry><cylinder radius="0.02" length="0.3"/></geometry></collision></link>
  <joint name="shoulder" type="revolute">
    <parent link="base"/><child link="arm"/><origin xyz="0 0 0.5"/><axis xyz="0 1 0"/>
    <limit lower="-2" upper="2" effort="1" velocity="1"/></joint>
</robot>"""
SCENE = """
name: beside_an_arm
time: {step: 0.005}
robot: {description: robot_description, prefix: left}
rods:
  - name: cable
    centerline: {straight: {from: [0, 2, 1], to: [1, 2, 1], edges: 10}}
    contact: {}
    grasps: {end: {edges: [0]}}
"""
DELAY = 1.0   # [s] by which a busy machine may keep a transform from the node


def commanded(t):
    """Turn of the joint [rad], at rest at first."""
    return 0.4 * (1 - math.cos(max(0.0, t)))


class Robot(NodeCase):

    def tearDown(self):
        NodeCase.tearDown(self)
        if rospy.has_param("/robot_description"):
            rospy.delete_param("/robot_description")

    def send(self, stamp, angle):
        def transform(parent, child, z, turn):
            message = TransformStamped()
            message.header.stamp = rospy.Time.from_sec(stamp)
            message.header.frame_id, message.child_frame_id = parent, child
            message.transform.translation.z = z
            message.transform.rotation.y, message.transform.rotation.w = math.sin(turn / 2), math.cos(turn / 2)
            return message
        self.tf.publish(TFMessage([transform("world", "left/base", 0, 0),
                                   transform("left/base", "left/arm", 0.5, angle)]))

    def move(self, seconds):
        rate, begin = rospy.Rate(100), rospy.get_time()
        while rospy.get_time() < begin + seconds:
            now = rospy.get_time()
            self.send(now, commanded(now - self.start_of_motion))
            rate.sleep()

    def run_beside_arm(self, **parameters):
        rospy.set_param("/robot_description", URDF)
        node = self.start(SCENE, pace="wall", guide_delay=DELAY, guide_timeout=5 * DELAY, **parameters)
        self.tf = self.publisher("/tf", TFMessage)
        return node

    def test_links_follow_tf_with_one_lag(self):
        self.run_beside_arm()
        obstacles = self.listen("/t/obstacle_states", BodyStates)
        self.start_of_motion = rospy.get_time() + 1.5
        self.move(5.0 + DELAY)
        end = rospy.Time.now()
        wait_until(lambda: obstacles.last().header.stamp >= end, what="a state of the end of the motion")
        states = [m for m in obstacles.all() if self.start_of_motion - 0.5 < m.header.stamp.to_sec() <= end.to_sec()]
        self.assertGreater(len(states), 200)
        worst, farthest = 0.0, 0.0
        for message in states:
            self.assertEqual(message.name, ["left/base", "left/arm"])
            turn = commanded(message.header.stamp.to_sec() - DELAY - self.start_of_motion)
            p = message.pose[1].position
            expected = (0.2 * math.cos(turn), 0.0, 0.5 - 0.2 * math.sin(turn))   # the collision element is 0.2 m off
            worst = max(worst, max(abs(a - b) for a, b in zip((p.x, p.y, p.z), expected)))
            farthest = max(farthest, abs(turn))
        self.assertGreater(farthest, 0.5)
        self.assertLess(worst, 2e-3)   # 100 Hz, 0.4 rad/s: 0.8 mm a message at 0.2 m

    def test_a_bag_holds_the_robot(self):
        node = self.run_beside_arm(record_bag=self.path("run.bag"))
        self.start_of_motion = rospy.get_time() + 0.3
        self.move(2.0 + DELAY)
        node.terminate()
        self.assertEqual(node.wait(60), 0, self.output("rod.err"))
        rospy.delete_param("/robot_description")
        node = self.start("", wait=False, pace="fast", replay=self.path("run.bag"), record_bag=self.path("again.bag"))
        self.assertEqual(node.wait(200), 0, self.output("rod.err"))
        first, again = self.raw("run.bag"), self.raw("again.bag")
        self.assertGreater(len(first), 200)
        self.assertTrue(first == again)

    def raw(self, bag):
        return [(topic, bytes(raw[1]), stamp)
                for topic, raw, stamp in rosbag.Bag(self.path(bag)).read_messages(raw=True)
                if not topic.endswith("/inputs")]

    def test_what_is_refused(self):
        for urdf, expected in ((None, "no ROS parameter of this name"),
                               ("robot", "ROS parameter robot_description is no URDF"),
                               ("<robot/>", "is no valid URDF"),
                               (URDF.replace("<box size=\"0.1 0.1 0.1\"/>",
                                             "<mesh filename=\"package://no_such_package/a.stl\"/>"),
                                "there is no ROS package no_such_package")):
            if urdf:
                rospy.set_param("/robot_description", urdf)
            node = self.start(SCENE, wait=False)
            self.assertEqual(node.wait(60), 2)
            self.assertIn(expected, self.output("rod.err"))

    def test_joint_motion_refuses_bad_tables(self):
        script = os.path.join(os.path.dirname(os.path.realpath(__file__)), "../../scripts/joint_motion")
        table = self.path("joints.csv")
        for content, more, expected in ((None, [], "No such file"), ("t,a\n0,1\n0,2\n", [], "times must rise"),
                                        ("t,a\n0,1,2\n", [], "as many numbers"), ("t,a\n0,nan\n", [], "must be finite"),
                                        ("t,a\n0,1\n", ["_release:={g: 1}"], "needs ~node")):
            if content:
                with open(table, "w") as file:
                    file.write(content)
            done = subprocess.run(["/usr/bin/python3", script, "__ns:=/t", "_file:=" + table] + more,
                                  stdout=subprocess.PIPE,
                                  stderr=subprocess.STDOUT, universal_newlines=True, timeout=60)
            self.assertEqual(done.returncode, 2, done.stdout)
            self.assertIn(expected, done.stdout)

    def test_joint_motion_plays_a_table(self):
        script = os.path.join(os.path.dirname(os.path.realpath(__file__)), "../../scripts/joint_motion")
        with open(self.path("joints.csv"), "w") as file:
            file.write("# a ramp\nt,a,b\n0,0,1\n1,2,1\n2,4,1\n")
        self.processes.append(subprocess.Popen(["/usr/bin/python3", script, "__ns:=/t", "_node:=/t/gate",
                                                "_file:=" + self.path("joints.csv")]))
        states = self.listen("/t/joint_states", JointState)
        gate = rospy.Service("/t/gate/set_grasp", SetGrasp, lambda request: None)   # the motion waits for it
        self.addCleanup(gate.shutdown)
        wait_until(lambda: states.count() > 0 and abs(states.last().position[0] - 4) < 1e-9,
                   what="the end of the table")
        self.assertEqual(states.last().name, ["a", "b"])
        moving = [m for m in states.all() if 0 < m.position[0] < 4]
        self.assertGreater(len(moving), 10)
        for a, b in zip(moving, moving[1:]):
            self.assertAlmostEqual(b.position[0] - a.position[0], 2 * (b.header.stamp - a.header.stamp).to_sec(),
                                   delta=1e-6)
            self.assertAlmostEqual(b.position[1], 1.0, delta=1e-9)


if __name__ == "__main__":
    run("robot_test", Robot)
