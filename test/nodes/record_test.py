#!/usr/bin/python3
"""record:=true of the launch files: rosbag record of all topics but pictures."""
import glob
import os
import subprocess
import unittest

import rosbag
import rospkg
import rospy
from slender_sim.msg import RodState

from node_harness import Listener, run, wait_until

BAGS = os.path.join(rospkg.get_ros_home(), "slender_sim_record_test_*.bag")


class Record(unittest.TestCase):

    def tearDown(self):
        for path in glob.glob(BAGS + "*"):
            os.remove(path)

    def test_bag_holds_the_states(self):
        states = Listener("state", RodState)
        wait_until(lambda: "/record" in self.readers(), what="rosbag to listen to /state")
        heard = states.count()
        wait_until(lambda: states.count() > heard + 50, what="states")
        subprocess.run(["rosnode", "kill", "/record"], stdout=subprocess.DEVNULL, check=True)
        wait_until(lambda: glob.glob(BAGS), what="the bag")
        with rosbag.Bag(glob.glob(BAGS)[0]) as bag:
            counts = {topic: info.message_count for topic, info in bag.get_type_and_topic_info().topics.items()}
        self.assertGreater(counts["/state"], 25)
        self.assertIn("/scene", counts)
        self.assertNotIn("/markers", counts)

    def readers(self):
        """Names of the nodes that subscribe to /state."""
        subscribers = dict(rospy.get_master().getSystemState()[2][1])
        return subscribers.get("/state", [])


if __name__ == "__main__":
    run("record_test", Record)
