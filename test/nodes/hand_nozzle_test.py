#!/usr/bin/python3
"""~interactive of thread_node and cloth_node: nozzles, grasps and obstacles are dragged by hand."""
import math

from slender_sim.msg import ClothState, RodState, ThreadState
from std_srvs.srv import Trigger

from hand_harness import HandCase
from node_harness import SCENE, run, wait_until

HONEY = """
name: honey
time: {step: 0.002, duration: 1}
threads:
  - name: honey
    fluid: {density: 1400, viscosity: 20, surface_tension: 0.05}
    nozzle: {position: [0, 0, 0.03], diameter: 0.005, flow: 6.0e-7, motion: {topic: true}}
    floor: {height: 0}
    edges: {feed: 0.002, longest: 0.003, shortest: 0.0006, deposited: 25}
"""
TWO = HONEY + """
  - name: glue
    fluid: {density: 1400, viscosity: 20, surface_tension: 0.05}
    nozzle: {position: [0.1, 0, 0.03], diameter: 0.005, flow: 6.0e-7}
    floor: {height: 0}
    edges: {feed: 0.002, longest: 0.003, shortest: 0.0006, deposited: 25}
"""
CLOTH = """
name: towel
time: {step: 0.01, duration: 1}
obstacles:
  - {name: ball, shape: {sphere: {radius: 0.05}}, pose: {position: [0, 0, 0.8]}, motion: {topic: true}}
  - {name: floor, shape: {plane: {}}}
cloths:
  - name: towel
    grid: {corner: [-0.2, -0.2, 1], sides: [[0.4, 0, 0], [0, 0.4, 0]], cells: 4}
    material: {area_density: 0.2, thickness: 0.0005, youngs_modulus: 5.0e5}
    solver: {one_newton_step: true}
    contact: {}
    grasps: {left: {corner: lower_left, motion: {topic: true}}, right: {corner: lower_right}}
"""


class HandOfOthers(HandCase):

    def test_rod(self):
        """Beside the others: `state` has another type in each test."""
        self.begin(SCENE, RodState, program="rod_node")
        start = self.after(1).nodes[-1]
        self.drag_by("grasps/right", 0, 0.1, 0)
        self.assertAlmostEqual(self.after(80).nodes[-1].y, start.y + 0.1, delta=1e-6)

    def test_nozzle(self):
        self.begin(HONEY, ThreadState, program="thread_node")
        self.after(1)
        self.drag_by("nozzle", 0.005, 0.0, 0.0)
        self.assertEqual(set(self.handles()), {"nozzle"})
        fastest, before = 0.0, self.after(1).nodes[-1].x
        for _ in range(119):
            now = self.after(1).nodes[-1].x
            fastest, before = max(fastest, (now - before) / 0.002), now
        self.assertAlmostEqual(before, 0.005, delta=1e-6)
        self.assertLess(fastest, 1.6)
        self.assertEqual(int(self.diagnostics("inputs")["dropped"]), 0)
        wait_until(lambda: abs(self.handles()["nozzle"].pose.position.x - 0.005) < 1e-9, what="the handle where the hand left it")
        self.assertTrue(self.call("reset", Trigger).success)
        wait_until(lambda: abs(self.handles()["nozzle"].pose.position.x) < 1e-9, what="the handle where the nozzle is again")
        self.assertAlmostEqual(self.after(2).nodes[-1].x, 0.0, delta=1e-9)

    def test_nozzle_of_one_thread_of_two(self):
        self.begin(TWO, ThreadState, program="thread_node")
        self.after(1)
        self.drag_by("threads/honey/nozzle", 0.0, 0.005, 0.0)
        self.assertEqual(set(self.handles()), {"threads/honey/nozzle"})   # the other one is fixed
        stamp = self.after(120).header.stamp
        last = {state.name: state for state in self.states.all_at(stamp, 2)}
        self.assertAlmostEqual(last["honey"].nodes[-1].y, 0.005, delta=1e-6)
        self.assertAlmostEqual(last["glue"].nodes[-1].y, 0.0, delta=1e-9)

    def test_cloth_grasp_and_obstacle(self):
        self.begin(CLOTH, ClothState, program="cloth_node")
        start = self.after(1)
        corner = min(range(len(start.vertices)), key=lambda i: start.vertices[i].x + start.vertices[i].y)
        self.drag_by("grasps/left", 0.0, 0.0, 0.1)
        self.assertEqual(set(self.handles()), {"grasps/left", "bodies/ball"})
        self.assertAlmostEqual(self.after(60).vertices[corner].z, start.vertices[corner].z + 0.1, delta=1e-6)
        self.drag_by("bodies/ball", 0.0, 0.0, 0.25)
        state = self.after(80)
        center = (0.0, 0.0, 1.05)
        self.assertGreater(min(math.dist((p.x, p.y, p.z), center) for p in state.vertices), 0.05)
        self.assertGreater(max(p.z for p in state.vertices), 1.04)      # it was pushed up
        self.assertEqual(int(self.diagnostics("inputs")["dropped"]), 0)


if __name__ == "__main__":
    run("hand_nozzle", HandOfOthers)
