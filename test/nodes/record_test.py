#!/usr/bin/python3
"""record:=true of the launch files: rosbag record of all topics but pictures."""
import glob
import os
import subprocess
import unittest

import rosbag
import rosgraph
import rospkg

from node_harness import run, sends, wait_until

BAGS = os.path.join(rospkg.get_ros_home(), "slender_sim_record_test_*.bag")


class Record(unittest.TestCase):

    def tearDown(self):
        for path in glob.glob(BAGS + "*"):
            os.remove(path)

    def test_bag_holds_the_states(self):
        def recorded():
            return sum(map(os.path.getsize, glob.glob(BAGS + ".active")))

        def topics():   # the recorder looks for new ones once a second
            subscribers = rosgraph.Master("/record_test").getSystemState()[1]
            return [topic for topic, nodes in subscribers if "/bag_recorder" in nodes]

        wait_until(lambda: {"/state", "/scene"} <= set(topics()), what="the recorder")
        wait_until(lambda: all(sends("/rod_node", topic, "/bag_recorder") for topic in ("/state", "/scene")),
                   what="its connections")
        before = recorded()
        wait_until(lambda: recorded() > before + 1000000, what="states in the bag")   # some 10 kB each
        subprocess.run(["rosnode", "kill", "/bag_recorder"], stdout=subprocess.DEVNULL, check=True)
        wait_until(lambda: glob.glob(BAGS), what="the bag")
        with rosbag.Bag(glob.glob(BAGS)[0]) as bag:
            counts = {topic: info.message_count for topic, info in bag.get_type_and_topic_info().topics.items()}
        self.assertGreater(counts["/state"], 25)
        self.assertIn("/scene", counts)
        self.assertNotIn("/markers", counts)


if __name__ == "__main__":
    run("record_test", Record)
