#!/usr/bin/python3
"""The demo, headless and in real time: no message is lost, and the rope ends in a loop that still holds its twist.
However busy the machine is, the test waits for the motion of the grippers to end."""
import math
import unittest

import rospy
from diagnostic_msgs.msg import DiagnosticArray
from node_harness import Listener, run, wait_until
from slender_sim.msg import RodState

STEP, EVERY = 0.004, 25   # [s], steps between states (demo.test)
END, REST = 0.67, 1.5     # [m] distance of the grippers at the end of their motion, [s] for which they rest there


def seen_from_camera(p, yaw=0.62, pitch=0.24):
    """Orthographic picture from where config/rviz/demo.rviz looks."""
    right = (-math.sin(yaw), math.cos(yaw), 0.0)
    up = (-math.cos(yaw) * math.sin(pitch), -math.sin(yaw) * math.sin(pitch), math.cos(pitch))
    return tuple(a[0] * p.x + a[1] * p.y + a[2] * p.z for a in (right, up))


def crossings(points):
    """How often a plane polyline crosses itself."""
    def side(a, b, c):
        return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    segments = list(zip(points, points[1:]))
    return sum(side(a, b, c) * side(a, b, d) < 0 and side(c, d, a) * side(c, d, b) < 0
               for i, (a, b) in enumerate(segments) for c, d in segments[i + 2:])


def at_end(message):
    return abs(message.nodes[-1].x - message.nodes[0].x - END) < 1e-6


class Demo(unittest.TestCase):

    def test_the_rope_loops(self):
        states = Listener("state", RodState)
        diagnostics = Listener("/diagnostics", DiagnosticArray)
        resting = round(REST / (STEP * EVERY))
        wait_until(lambda: states.count() > resting and all(map(at_end, states.all()[-resting:])), 400,
                   "the end of the motion")
        messages = states.all()
        steps = [m.step for m in messages]
        self.assertEqual(steps, list(range(steps[0], steps[0] + EVERY * len(steps), EVERY)))
        last = messages[-1]
        twist = sum(last.twists) / (2 * math.pi)
        self.assertGreater(twist, 2.0)   # 3 turns less what the loop takes; one pull-through would cost 2
        self.assertLess(twist, 3.0)
        self.assertEqual(crossings([seen_from_camera(p) for p in last.nodes]), 1)
        values = {}
        for status in diagnostics.last().status:
            values.update({value.key: value.value for value in status.values})
        self.assertEqual(values["dropped"], "0")


if __name__ == "__main__":
    run("demo_test", Demo)
