#!/usr/bin/python3
"""thread_node: nozzle, flow and belt by message; ids of nodes that are fed, divided and dropped; bad values."""
import math

from geometry_msgs.msg import PoseStamped, Vector3Stamped, WrenchStamped
from std_msgs.msg import Float64
from slender_sim.msg import ThreadState
from slender_sim.srv import FilePath
from std_srvs.srv import Trigger

from node_harness import NodeCase, numbers, pose, run, wait_until

STEP = 0.002
FLOW = 6e-7
HEIGHT = 0.03
SCENE = """
name: honey
time: {step: 0.002, duration: 1}
threads:
  - name: honey
    fluid: {density: 1400, viscosity: 20, surface_tension: 0.05}
    nozzle: {position: [0, 0, 0.03], diameter: 0.005, flow: {topic: true, initial: 6.0e-7}, motion: {topic: true}}
    floor: {height: 0, belt: {topic: true}}
    edges: {feed: 0.002, longest: 0.003, shortest: 0.0006, deposited: 25}
"""


def belt(x, y, frame="world"):
    message = Vector3Stamped()
    message.header.frame_id = frame
    message.vector.x, message.vector.y = x, y
    return message


class Thread(NodeCase):

    def begin(self):
        self.start(SCENE, program="thread_node")
        self.states = self.listen("/t/state", ThreadState)

    def after(self, n):
        return self.states_after(self.states, n)

    def test_flow_by_message(self):
        self.begin()
        flow = self.publisher("/t/nozzle/flow", Float64)
        before = self.after(50)
        self.assertAlmostEqual(before.fed_volume, 50 * STEP * FLOW, delta=1e-9 * FLOW)
        flow.publish(3 * FLOW)
        self.arrived()
        more = self.after(50)
        self.assertAlmostEqual(more.fed_volume - before.fed_volume, 150 * STEP * FLOW, delta=1e-9 * FLOW)
        for bad in (float("nan"), -1.0, float("inf"), 1.0, 1e300):   # 1 m^3/s is a mistaken unit, and would take a step for ever
            flow.publish(bad)
        self.expect_drop("not_finite", 2)
        self.expect_drop("out_of_range", 3)
        self.assertAlmostEqual(float(self.diagnostics("inputs")["nozzle/flow [m^3/s]"]), 3 * FLOW, delta=1e-5 * FLOW)
        kept = self.after(10)
        self.assertAlmostEqual(kept.fed_volume - more.fed_volume, 30 * STEP * FLOW, delta=1e-9 * FLOW)
        flow.publish(0.0)
        self.arrived()
        self.assertAlmostEqual(self.after(10).fed_volume, kept.fed_volume, delta=1e-9 * FLOW)

    def test_nozzle_by_message(self):
        self.begin()
        nozzle = self.publisher("/t/nozzle/pose", PoseStamped)
        wrenches = self.listen("/t/nozzle/wrench", WrenchStamped)
        down = (0.0, math.sqrt(0.5), 0.0, math.sqrt(0.5))    # x axis turned to -z
        start = self.after(100)
        self.assertAlmostEqual(start.nodes[-1].z, HEIGHT, places=9)
        for k in range(1, 51):
            nozzle.publish(pose(0.0004 * k, 0, HEIGHT, stamp=1.0 + STEP * (100 + k), q=down))
        self.arrived()
        moved = self.after(60)
        self.assertAlmostEqual(moved.nodes[-1].x, 0.02, delta=1e-6)
        self.assertLess(max(abs(p.y) for p in moved.nodes), 0.01)
        self.assertLess(wrenches.at(moved.header.stamp).wrench.force.z, 0.0)   # hangs on the nozzle
        nozzle.publish(pose(0.02, 0, float("nan"), stamp=5.0))
        self.expect_drop("not_finite")
        nozzle.publish(pose(0.02, 0, HEIGHT, stamp=1.4, q=(0, 0, 0, 3)))
        self.expect_drop("bad_quaternion")
        nozzle.publish(pose(0.02, 1e300, HEIGHT, stamp=1.4, q=down))
        self.expect_drop("out_of_range")
        self.assertAlmostEqual(self.after(5).nodes[-1].x, 0.02, delta=1e-6)

    def test_belt_by_message(self):
        self.begin()
        velocity = self.publisher("/t/belt/velocity", Vector3Stamped)
        velocity.publish(belt(0.03, -0.01))
        self.arrived()
        state = self.after(700)
        lying = [v for v, d in zip(state.velocities, bytearray(state.deposited)) if d]
        self.assertGreater(len(lying), 5)
        for v in lying:
            self.assertAlmostEqual(v.x, 0.03, places=12)
            self.assertAlmostEqual(v.y, -0.01, places=12)
        velocity.publish(belt(float("nan"), 0))
        velocity.publish(belt(1, 0, frame=""))
        velocity.publish(belt(1, 0, frame="nowhere"))
        self.expect_drop("not_finite")
        self.expect_drop("bad_frame")
        self.expect_drop("no_transform")
        velocity.publish(belt(1e4, 0))
        self.expect_drop("out_of_range")
        oldest = {i: p for i, p in zip(state.ids, state.nodes)}
        later = self.after(50)
        common = [(oldest[i], p) for i, p, d in zip(later.ids, later.nodes, bytearray(later.deposited)) if d and i in oldest]
        carried = [q.x - p.x for p, q in common][0]
        self.assertAlmostEqual(carried, 50 * STEP * 0.03, places=9)

    def test_ids_stay_consistent(self):
        self.begin()
        self.publisher("/t/belt/velocity", Vector3Stamped).publish(belt(0.04, 0))
        self.arrived()
        for _ in range(10):
            self.after(200)                                            # topics drop what nobody takes in time
        self.assertGreater(self.states.count(), 1900)
        newest, first, seen_first, unsorted = -1, -1, 0, 0
        known = set()
        for state in self.states.all():
            ids = list(state.ids)
            self.assertEqual(len(ids), len(set(ids)))
            self.assertEqual(len(ids), len(state.nodes))
            self.assertEqual(len(ids), len(state.radii) + 1)
            self.assertEqual(state.first_id, min(ids[:-1]))
            self.assertGreaterEqual(state.first_id, first)             # so that all below are gone for good
            unsorted += ids[0] != min(ids[:-1])
            fresh = [i for i in ids if i not in known]
            self.assertTrue(all(i > newest for i in fresh), "an id came again")
            if state.first_id != first:
                first, seen_first = state.first_id, seen_first + 1
            newest = max([newest] + fresh)
            known.update(ids)
        self.assertGreater(unsorted, 0)                                # edges were divided
        self.assertGreater(seen_first, 5)                              # old nodes were dropped
        self.assertGreater(newest, len(self.states.last().ids))        # and new ones fed

    def test_wrench_belongs_to_the_state(self):
        self.begin()
        wrenches = self.listen("/t/nozzle/wrench", WrenchStamped)

        def wrench_with(state):
            return wrenches.at(state.header.stamp).wrench.force.z

        def first_of(epoch):
            wait_until(lambda: self.states.last().epoch == epoch, what="the state of epoch %d" % epoch)
            return self.states.last()
        saved = wrench_with(self.after(1))
        self.assertTrue(self.call("save_state", FilePath, self.path("state")).success)
        states = [self.after(1) for _ in range(50)]
        self.assertNotEqual(wrench_with(states[-1]), saved)
        self.assertTrue(self.call("load_state", FilePath, self.path("state")).success)
        self.assertEqual(wrench_with(first_of(epoch=1)), saved)
        self.assertEqual([numbers(self.after(1)) for _ in range(50)], [numbers(state) for state in states])
        self.assertTrue(self.call("reset", Trigger).success)
        self.assertEqual(wrench_with(first_of(epoch=2)), 0.0)

    def test_several_threads(self):
        glue = SCENE.split("threads:\n")[1].replace("name: honey", "name: glue").replace("[0, 0, 0.03]", "[0.1, 0, 0.03]")
        self.start(SCENE + glue, program="thread_node")
        states = self.listen("/t/state", ThreadState)
        flow = self.publisher("/t/threads/glue/nozzle/flow", Float64)
        flow.publish(-1.0)
        self.expect_drop("out_of_range")
        self.assertIn("threads/glue/nozzle/flow: dropped", self.output("rod.err") + self.output("rod.out"))
        flow.publish(2 * FLOW)
        self.arrived()
        both = states.all_at(self.step(50).stamp, 2)
        self.assertEqual(len(both), 2)
        fed = {s.name: s.fed_volume for s in both}
        self.assertAlmostEqual(fed["honey"], 50 * STEP * FLOW, delta=1e-9 * FLOW)
        self.assertAlmostEqual(fed["glue"], 100 * STEP * FLOW, delta=1e-9 * FLOW)
        values = self.diagnostics("simulation")
        self.assertEqual(values["threads and pieces"], "2")
        self.assertEqual(int(values["nodes"]), sum(len(s.nodes) for s in both))


if __name__ == "__main__":
    run("thread_test", Thread)
