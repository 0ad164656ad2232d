#!/usr/bin/python3
"""launch/nodelets.launch: a cloth and a shell that tracks it in one manager, which outlives what is unloaded from it."""
import unittest

import rospy
from diagnostic_msgs.msg import DiagnosticArray
from nodelet.srv import NodeletList, NodeletLoad, NodeletUnload
from slender_sim.msg import ClothState

from node_harness import Listener, run, wait_until


class NodeletsLaunch(unittest.TestCase):

    def test_shell_follows_the_cloth(self):
        shell = Listener("/state", ClothState)
        cloth = Listener("/coarse/state", ClothState)
        wait_until(lambda: shell.count() > 300 and cloth.count() > 300, timeout=60, what="states of both")
        self.assertEqual((shell.last().names, cloth.last().names), (["fine"], ["coarse"]))
        guide = {m.header.stamp.to_nsec(): m for m in cloth.all()}
        last = shell.last()
        # the guide is the cloth of ~guide_delay ago, between two of its messages
        stamps = sorted(guide)
        self.assertLess(min(p.z for p in last.guide_vertices), 0.8)   # it lay at 1 m
        delayed = last.header.stamp.to_nsec() - 30000000
        near = min(stamps, key=lambda s: abs(s - delayed))
        self.assertLess(abs(near - delayed), 20000000)
        for a, b in zip(last.guide_vertices, guide[near].vertices):
            self.assertLess(abs(a.x - b.x) + abs(a.y - b.y) + abs(a.z - b.z), 0.05)
        self.assertLess(max(last.constraint_errors), 1e-9)

        names = {status.name for k in range(4) for status in rospy.wait_for_message("/diagnostics", DiagnosticArray, 10).status}
        self.assertTrue(names & {"/coarse: simulation", "/fine: simulation"}, names)

    def test_unload_and_load(self):
        rospy.wait_for_service("/simulation/load_nodelet", 20)
        load = rospy.ServiceProxy("/simulation/load_nodelet", NodeletLoad)
        unload = rospy.ServiceProxy("/simulation/unload_nodelet", NodeletUnload)
        loaded = rospy.ServiceProxy("/simulation/list", NodeletList)
        wait_until(lambda: len(loaded().nodelets) == 2, timeout=30, what="two nodelets")
        rospy.set_param("/visitor/scene", "rods: [{name: a, colour: red}]\n")
        with self.assertRaises(rospy.ServiceException):
            if not load("/visitor", "slender_sim/rod_node", [], [], [], "").success:
                raise rospy.ServiceException("refused")
        self.assertEqual(len(loaded().nodelets), 2)
        rospy.set_param("/visitor/scene", "rods: [{name: a}]\n")
        self.assertTrue(load("/visitor", "slender_sim/rod_node", ["/state"], ["/visitor/state"], [], "").success)
        self.assertEqual(len(loaded().nodelets), 3)
        self.assertTrue(unload("/visitor").success)
        self.assertEqual(len(loaded().nodelets), 2)


if __name__ == "__main__":
    run("nodelets_launch", NodeletsLaunch)
