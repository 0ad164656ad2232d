#!/usr/bin/python3
"""Two arms hang a cable on a hook and let go. The cable comes to rest over the hook with both ends lower, and the hook
carries its weight."""
import math
import unittest

import rospy
from node_harness import Listener, run, wait_until
from slender_sim.msg import Fields, GraspStates, RodState

LENGTH, RADIUS, DENSITY, GRAVITY = 0.9, 0.006, 1100.0, 9.81   # config/scenes/two_arms_hook.yaml
WEIGHT = DENSITY * math.pi * RADIUS ** 2 * LENGTH * GRAVITY   # [N]
PEG_TOP = 0.7 + 0.012                                         # [m] its axis is y, at x = 0
PEG_BEGIN, PEG_END = -0.04, 0.12                              # [m] along y, from the tip to the wall


def fastest(state):
    return max(math.sqrt(v.x ** 2 + v.y ** 2 + v.z ** 2) for v in state.velocities)


def upward_contact(message):
    """z components of the contact forces on the nodes [N]."""
    table = next(t for t in message.tables if t.table == "rod_fields" and t.object == "cable")
    width = len(table.columns)
    return list(table.values[table.columns.index("contact_fz [N]")::width])


class Hook(unittest.TestCase):

    def test_the_cable_hangs_on_the_hook(self):
        states = Listener("state", RodState)
        grasps, fields = Listener("grasp_states", GraspStates), Listener("fields", Fields)
        wait_until(lambda: states.count() > 0 and grasps.count() > 0, 120, "states")
        self.assertTrue(all(grasps.all()[0].active))
        wait_until(lambda: not any(grasps.last().active), 300, "both grippers to let go")
        free = next(message.header.stamp for message in grasps.all() if not any(message.active))

        def rests():
            """It has fallen: at the instant at which it is let go, nothing moves yet."""
            state = states.last()
            return state.header.stamp > free + rospy.Duration(1) and fastest(state) < 0.02
        wait_until(rests, 200, "the cable to come to rest")
        last = states.last()
        top = max(last.nodes, key=lambda p: p.z)
        # it lies on the peg: within a centimetre of where its axis is if it touches
        self.assertAlmostEqual(top.z, PEG_TOP + RADIUS, delta=0.01)
        self.assertLess(abs(top.x), 0.03)
        self.assertTrue(PEG_BEGIN < top.y < PEG_END, top)
        for end in (last.nodes[0], last.nodes[-1]):
            self.assertLess(end.z, top.z - 0.3)
        self.assertLess(last.nodes[0].x, last.nodes[-1].x)
        # nothing else holds it up: contact carries its weight, and all of that near the hook
        up = upward_contact(fields.at(last.header.stamp))
        self.assertEqual(len(up), len(last.nodes))
        self.assertAlmostEqual(sum(up), WEIGHT, delta=0.05 * WEIGHT)
        self.assertAlmostEqual(sum(f for p, f in zip(last.nodes, up) if p.z > PEG_TOP - 0.1), WEIGHT,
                               delta=0.05 * WEIGHT)


if __name__ == "__main__":
    run("robot_hook_test", Hook)
