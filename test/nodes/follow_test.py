#!/usr/bin/python3
"""~pace: follow behind `rosbag play --clock`: recorded grippers move the rope as they did, at whatever rate the bag is played."""
import subprocess

import rosbag
import rospy
from diagnostic_msgs.msg import DiagnosticArray
from rosgraph_msgs.msg import Clock

from node_harness import NodeCase, pose, run, wait_until

BEGIN, LENGTH, RATE = 100.0, 5.0, 50.0      # s, s, Hz
DELAY = 2.0      # s: what a busy machine may keep a message from the node, twice as fast half of it
STEP = 0.005     # s


def height(t):
    """Of the gripper, t [s] after the bag's first message [m]."""
    s = min(max((t - 0.5) / 1.5, 0.0), 1.0)
    return 0.3 * s * s * (3 - 2 * s)


class Follow(NodeCase):

    def setUp(self):
        NodeCase.setUp(self)
        self.simulated = -1.0   # [s] none yet

    def take(self, message):
        for status in message.status:
            values = {value.key: value.value for value in status.values}
            self.simulated = float(values.get("simulated time [s]", self.simulated))

    def tearDown(self):
        NodeCase.tearDown(self)
        if rospy.has_param("/use_sim_time"):
            rospy.delete_param("/use_sim_time")

    def play(self, *options):
        bag = self.path("grippers.bag")
        with rosbag.Bag(bag, "w") as out:
            for k in range(int(LENGTH * RATE) + 1):
                t = BEGIN + k / RATE
                message = pose(1.0, 0.0, 1.0 + height(t - BEGIN), stamp=t)
                out.write("/t/grasps/right/pose", message, rospy.Time.from_sec(t))
        # the queue holds all messages of the bag: none is lost however late they are sent
        command = ["rosbag", "play", "--clock", "--hz=50", "--queue=1000", "--wait-for-subscribers", "-q"]
        player = subprocess.Popen(command + list(options) + [bag],
                                  stdin=subprocess.DEVNULL, stdout=open(self.path("play.out"), "w"), stderr=subprocess.STDOUT)
        self.processes.append(player)
        return player

    def follow(self, *options):
        rospy.set_param("/use_sim_time", True)
        self.start(wait=False, pace="follow", guide_delay=DELAY, guide_timeout=2 * DELAY,
                   record_bag=self.path("run.bag"))
        clock = self.publisher("/clock", Clock)   # the node subscribes and advertises when it has heard the clock
        # States are taken from the node's own bag, which misses none. What is heard live are its reports, twenty a
        # second.
        reports = rospy.Subscriber("/diagnostics", DiagnosticArray, self.take)
        self.ends.append(reports)

        def heard():
            clock.publish(Clock(rospy.Time.from_sec(BEGIN)))
            return self.simulated >= 0.0
        wait_until(heard, what="the node to hear the clock")
        player = self.play(*options)
        self.assertEqual(player.wait(100), 0, self.output("play.out"))
        def at_end():
            clock.publish(Clock(rospy.Time.from_sec(BEGIN + LENGTH)))   # that of the player may end with it, unsent
            return self.simulated > LENGTH - 0.05
        wait_until(at_end, what="the end of the bag")
        node = self.processes[0]
        node.terminate()
        self.assertEqual(node.wait(60), 0)
        with rosbag.Bag(self.path("run.bag")) as bag:
            return [message for _, message, _ in bag.read_messages(topics=["/t/state"])]

    def check(self, states):
        stamps = [state.header.stamp.to_sec() for state in states]
        self.assertAlmostEqual(stamps[0], BEGIN, delta=1e-6)
        self.assertLess(stamps[-1], BEGIN + LENGTH + 0.1)     # never ahead of the clock
        for a, b in zip(stamps, stamps[1:]):
            self.assertAlmostEqual(b - a, STEP, delta=1e-6)  # no step is skipped
        worst = 0.0
        for stamp, state in zip(stamps, states):
            if stamp > BEGIN + 0.5:
                worst = max(worst, abs(state.nodes[-1].z - 1.0 - height(stamp - DELAY - BEGIN)))
        print("worst distance of the grasp from the recorded gripper %.2e m" % worst)
        self.assertLess(worst, 1e-3)       # cubics through 50 poses a second
        self.assertAlmostEqual(states[-1].nodes[-1].z, 1.3, delta=1e-3)

    def test_at_the_bags_own_rate(self):
        self.check(self.follow())

    def test_twice_as_fast(self):
        self.check(self.follow("--rate=2"))


if __name__ == "__main__":
    run("follow", Follow)
