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
        wait_until(lambda: shell.count() > 300 and cloth.count() > 300, 240, "states of both")
        self.assertEqual((shell.last().names, cloth.last().names), (["fine"], ["coarse"]))

        def follows():
            """The guide is the cloth of ~guide_delay ago, between two of its messages; a busy machine may be late for a while."""
            guide = {m.header.stamp.to_nsec(): m for m in cloth.all()}
            last = shell.last()
            delayed = last.header.stamp.to_nsec() - 30000000
            near = min(guide, key=lambda s: abs(s - delayed))
            return (min(p.z for p in last.guide_vertices) < 0.8 and abs(near - delayed) < 20000000 and   # it lay at 1 m
                    all(abs(a.x - b.x) + abs(a.y - b.y) + abs(a.z - b.z) < 0.05 for a, b in zip(last.guide_vertices, guide[near].vertices)))

        wait_until(follows, what="the shell to be where the cloth was")
        self.assertLess(max(max(m.constraint_errors) for m in shell.all()), 1e-9)

        names = {status.name for k in range(4) for status in rospy.wait_for_message("/diagnostics", DiagnosticArray, 60).status}
        self.assertTrue(names & {"/coarse: simulation", "/fine: simulation"}, names)

    def test_unload_and_load(self):
        for service in ("load_nodelet", "unload_nodelet", "list"):
            rospy.wait_for_service("/simulation/" + service, 60)
        load = rospy.ServiceProxy("/simulation/load_nodelet", NodeletLoad)
        unload = rospy.ServiceProxy("/simulation/unload_nodelet", NodeletUnload)
        loaded = rospy.ServiceProxy("/simulation/list", NodeletList)
        wait_until(lambda: len(loaded().nodelets) == 2, what="two nodelets")
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
