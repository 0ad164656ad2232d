#!/usr/bin/python3
"""~spawn, ~remove, ~attach, ~detach, ~set_parameter: the scene changes while it runs, a refused edit changes nothing,
and a replay repeats all edits."""
import math
import os
import subprocess

import rosbag
import rosgraph
import rospy
from geometry_msgs.msg import PoseStamped, WrenchStamped
from sensor_msgs import point_cloud2
from sensor_msgs.msg import PointCloud2
from slender_sim.msg import BodyStates, ClothState, GraspStates, Input, MeshStamped, RodState, ThreadState
from slender_sim.srv import EditScene, FilePath
from std_msgs.msg import Float64, String
from std_srvs.srv import SetBool, Trigger
from visualization_msgs.msg import Marker, MarkerArray

from node_harness import NodeCase, find_program, numbers, pose, run, wait_until

ROPE = """
name: edited_rope
time: {step: 0.005}
rods:
  - name: rope
    centerline: {straight: {from: [0, 0, 1], to: [1, 0, 1], edges: 20}}
    cross_section: {radius: 0.01}
    material: {density: 1000, youngs_modulus: 1.0e6, poissons_ratio: 0.45}
    damping: {mass: 2.0}
    contact: {}
    grasps:
      left: {edges: [0]}
      right: {edges: [-1], motion: {topic: true}, attach: initial}
"""
BALL = "bodies: [{name: ball, shape: {sphere: {radius: 0.03}}, mass: 0.3, pose: {position: [0.5, 0, %g]}}]"

SHEET = """
name: sheet
time: {step: 0.005}
cloths:
  - name: sheet
    grid: {corner: [0, 0, 0], sides: [[0.4, 0, 0], [0, 0.4, 0]], cells: [4, 4], pattern: one_diagonal}
    material: {area_density: 0.2, youngs_modulus: 1.0e5, thickness: 0.001}
    grasps: {left: {edge: left}}
"""
SECOND = """
cloths:
  - name: second
    grid: {corner: [2, 0, 0], sides: [[0.2, 0, 0], [0, 0.2, 0]], cells: [2, 2], pattern: one_diagonal}
    material: {area_density: 0.2, youngs_modulus: 1.0e5, thickness: 0.001}
"""
TRACKED = """
name: flap
time: {step: 0.01}
cloths:
  - name: other
    grid: {corner: [3, 0, 0], sides: [[0.4, 0, 0], [0, 0.4, 0]], cells: [2, 2]}
    material: {area_density: 0.2, youngs_modulus: 1.0e5, thickness: 0.001}
tracked:
  - name: flap
    guide: {mesh: {file: %s}, motion: {topic: points}}
    mesh: {subdivide: 2}
    material: {area_density: 0.2, thickness: 0.0005, youngs_modulus: 2.0e5}
    bending: {model: hinge}
    damping: {mass: 5, stiffness: 0.002}
"""
HONEY = """
name: honey
time: {step: 0.002}
threads:
  - name: honey
    fluid: {density: 1400, viscosity: 100}
    nozzle: {position: [0, 0, 0.03], diameter: 0.005, flow: {topic: true, initial: 6.0e-7}}
    floor: {height: 0}
"""


def middle(state):
    return state.nodes[10].z


class Edits(NodeCase):

    def edit(self, service, text):
        return self.call(service, EditScene, text)

    def done(self, service, text):
        answer = self.edit(service, text)
        self.assertTrue(answer.success, answer.message)
        return answer

    def refused(self, service, text, why):
        answer = self.edit(service, text)
        self.assertFalse(answer.success)
        self.assertIn(why, answer.message)

    def published(self, topic):
        publishers, _, _ = rosgraph.Master("/edits_test").getSystemState()
        return any(name == topic and "/t/rod" in nodes for name, nodes in publishers)

    def test_a_ball_is_spawned_falls_on_the_rope_and_is_removed(self):
        self.start(ROPE)
        state = self.listen("/t/state", RodState)
        scene = self.listen("/t/scene", String)
        markers = self.listen("/t/markers", MarkerArray)
        before = self.states_after(state, 40)
        self.assertFalse(self.published("/t/body_states"))
        self.refused("spawn", BALL % middle(before), "ball")   # within the rope
        self.done("spawn", BALL % (middle(before) + 0.1))
        bodies = self.listen("/t/body_states", BodyStates)
        wait_until(lambda: "ball" in scene.last().data, what="the edited scene")
        after = self.states_after(state, 60)
        self.assertEqual(after.step, 100)
        self.assertEqual(after.epoch, before.epoch)   # nothing jumped
        ball = bodies.at(after.header.stamp).pose[0].position.z
        self.assertGreater(ball, middle(after) + 0.035)   # the radii are 0.04 together
        self.assertLess(ball, middle(after) + 0.06)
        wait_until(lambda: any("ball" in m.ns or "bod" in m.ns for message in markers.all() for m in message.markers),
                   what="a picture of the ball")
        self.done("remove", "ball")
        wait_until(lambda: not self.published("/t/body_states"), what="the end of body_states")
        wait_until(lambda: any(m.action == Marker.DELETE for message in markers.all() for m in message.markers),
                   what="the end of its picture")
        free = self.states_after(state, 60)
        self.assertGreater(middle(free), middle(after) + 0.01)
        # the subscriber heard all the time
        self.assertEqual([m.step for m in state.all()][-120:], list(range(41, 161)))
        self.refused("remove", "ball", "there is no object \"ball\"")
        self.refused("remove", "rope", "is the last object")

    def test_a_grasp_is_attached_moved_and_detached(self):
        self.start(ROPE)
        state = self.listen("/t/state", RodState)
        before = self.states_after(state, 60)
        self.refused("attach", "rope: {left: {nodes: [10]}}", "has a grasp left already")
        self.refused("attach", "rope: {hand: {nodes: [0]}}", "0")
        self.refused("attach", "rope: {hand: {nodes: [10], motion: {tf: t/rod/grasps/left}}}",
                     "which this node broadcasts itself")
        self.refused("attach", "rope: {hand: {nodes: [10], motion: {tf: t/rod/grasps/hand}}}",
                     "which this node broadcasts itself")
        self.done("attach", "rope: {hand: {nodes: [10], motion: {topic: true}}}")
        guide = self.publisher("/t/grasps/hand/pose", PoseStamped)
        wrench = self.listen("/t/grasps/hand/wrench", WrenchStamped)
        grasps = self.listen("/t/grasp_states", GraspStates)
        held = self.states_after(state, 5)
        self.assertAlmostEqual(middle(held), middle(before), delta=1e-9)   # where it was, although it was falling
        for k in range(60):
            x = held.nodes[10]
            guide.publish(pose(x.x, x.y + 0.002 * (k + 1), x.z, q=(0, 0, 0, 1)))
            self.arrived()
            moved = self.states_after(state, 1)
        moved = self.states_after(state, 100)
        self.assertAlmostEqual(moved.nodes[10].y, held.nodes[10].y + 0.12, delta=1e-3)
        force = wrench.at(moved.header.stamp).wrench.force
        self.assertGreater(math.sqrt(force.x ** 2 + force.y ** 2 + force.z ** 2), 0.01)
        self.assertEqual(wrench.at(moved.header.stamp).header.frame_id, "t/rod/grasps/hand")
        self.assertEqual(grasps.at(moved.header.stamp).name, ["left", "right", "hand"])
        self.done("detach", "hand")
        wait_until(lambda: guide.get_num_connections() == 0, what="the end of its topic")
        wait_until(lambda: not self.published("/t/grasps/hand/wrench"), what="the end of its wrench")
        free = self.states_after(state, 150)
        self.assertLess(free.nodes[10].y, held.nodes[10].y + 0.1)
        self.refused("detach", "hand", "there is no grasp \"hand\"")

    def test_guides_go_on_over_an_edit(self):
        """What was heard before an edit holds after it, also where places in lists change."""
        self.start(ROPE)
        state = self.listen("/t/state", RodState)
        right = self.publisher("/t/grasps/right/pose", PoseStamped)
        right.publish(pose(1, 0, 1))
        self.arrived()
        self.states_after(state, 5)
        right.publish(pose(0.9, 0, 1))
        self.arrived()
        self.states_after(state, 2)
        self.done("detach", "left")
        arrived = self.states_after(state, 100)   # without another message
        self.assertAlmostEqual(arrived.nodes[20].x, 0.9, delta=1e-6)
        right.publish(pose(0.8, 0, 1))            # and the topic is still heard
        self.arrived()
        self.assertAlmostEqual(self.states_after(state, 100).nodes[20].x, 0.8, delta=1e-6)

    def test_parameters_change_what_they_say(self):
        self.start(ROPE)
        state = self.listen("/t/state", RodState)
        self.states_after(state, 300)
        stiff = self.states_after(state, 1)
        self.done("set_parameter", "rods.rope.material.youngs_modulus=2e5")
        soft = self.states_after(state, 300)
        self.assertLess(middle(soft), middle(stiff) - 0.02)
        self.done("set_parameter", "wind.velocity=[0, 3, 0]\nrods.0.damping={mass: 0.5, drag: 0.2}")
        self.assertGreater(self.states_after(state, 100).nodes[10].y, 0.02)
        before = self.states_after(state, 1)
        for text, why in (("rods.rope.centerline.straight.edges=30", "these may change while the scene runs"),
                          ("time.step=0.1", "may not change"),
                          ("rods.rope.material.density=-1", "must be a number in"),
                          ("rods.rope.materal.density=1", "these may change"), ("", "PATH=VALUE")):
            self.refused("set_parameter", text, why)
        self.assertEqual(state.last(), before)
        self.assertEqual(self.states_after(state, 1).step, before.step + 1)   # it runs on

    def test_new_warnings_are_answers(self):
        # bdf2 bounces where there is contact
        self.start(ROPE.replace("step: 0.005", "step: 0.005, integrator: bdf2"))
        self.assertIn("leave a collision", self.output("rod.err"))
        self.assertEqual(self.done("set_parameter", "wind.velocity=[0, 0, 0]").message, "")
        answer = self.done("attach", "rope: {hand: {nodes: [3], motion: {body: robot}}}")
        self.assertIn("the scene has no body or obstacle of this name", answer.message)
        self.assertNotIn("bounce", answer.message)
        self.publisher("/t/bodies", BodyStates)   # which it listens to now
        self.assertEqual(self.done("detach", "hand").message, "")

    def test_states_and_resets_after_edits(self):
        self.start(ROPE)
        state = self.listen("/t/state", RodState)
        self.states_after(state, 60)
        self.assertTrue(self.call("save_state", FilePath, self.path("before")).success)
        self.done("spawn", BALL % 1.0)   # where the rope was at the start
        answer = self.call("load_state", FilePath, self.path("before"))
        self.assertFalse(answer.success)
        self.assertIn("belongs to another scene", answer.message)
        answer = self.call("reset", Trigger)
        self.assertFalse(answer.success)
        self.assertIn("the edited scene cannot start anew", answer.message)
        self.assertTrue(self.call("save_state", FilePath, self.path("after")).success)
        first = self.states_after(state, 30)
        self.assertTrue(self.call("load_state", FilePath, self.path("after")).success)
        self.assertEqual(numbers(self.states_after(state, 30)), numbers(first))
        self.done("remove", "ball")
        self.assertTrue(self.call("load_state", FilePath, self.path("before")).success)   # its scene is back
        self.assertTrue(self.call("reset", Trigger).success)
        wait_until(lambda: state.last().step == 0, what="the state after the reset")
        self.assertEqual(middle(state.last()), 1.0)

    def test_cloths(self):
        self.start(SHEET, program="cloth_node", record_bag=self.path("run.bag"))
        state = self.listen("/t/state", ClothState)
        mesh = self.listen("/t/mesh", MeshStamped)
        self.states_after(state, 30)
        self.done("spawn", SECOND)
        wait_until(lambda: mesh.last().names == ["sheet", "second"], what="the mesh of both cloths")
        both = self.states_after(state, 10)
        self.assertEqual((both.names, list(both.offsets), len(both.vertices)), (["sheet", "second"], [0, 25], 34))
        self.assertEqual((mesh.last().names, len(mesh.last().vertices)), (["sheet", "second"], 34))
        before = both.vertices[24].z   # the corner of two free sides
        self.assertLess(before, -0.01)
        self.done("attach", "sheet: {hand: {edge: right, motion: {topic: true}}}")
        guide = self.publisher("/t/grasps/hand/pose", PoseStamped)
        held = self.states_after(state, 20)
        self.assertAlmostEqual(held.vertices[24].z, before, delta=1e-9)
        self.refused("attach", "sheet: {other: {vertices: [24]}}", "which grasp hand holds already")
        self.refused("spawn",
                     "cloths: [{name: third, grid: {corner: [0, 0, 0], sides: [[1, 0], [0, 1, 0]], cells: 4}}]",
                     "~spawn:1: cloths.2.grid.sides.0")
        self.done("detach", "hand")
        wait_until(lambda: guide.get_num_connections() == 0, what="the end of its topic")
        self.done("remove", "sheet")
        wait_until(lambda: mesh.last().names == ["second"], what="the mesh of what is left")
        left = self.states_after(state, 10)
        self.assertEqual((left.names, len(left.vertices)), (["second"], 9))
        self.processes[-1].terminate()
        self.assertEqual(self.processes[-1].wait(60), 0, self.output("rod.err"))
        # pictures of the bag have the faces of what was there at each instant
        out = subprocess.run([find_program("bag_to_mesh"), self.path("run.bag"), "--out", self.path("meshes"),
                              "--format", "obj"], stdout=subprocess.PIPE,
                             stderr=subprocess.STDOUT, universal_newlines=True)
        self.assertEqual(out.returncode, 0, out.stdout)
        files = sorted(os.listdir(self.path("meshes")))
        faces = [self.faces(os.path.join(self.path("meshes"), name)) for name in files]
        self.assertIn(32 + 8, faces)
        self.assertEqual((faces[0], faces[-1]), (32, 8), files)

    def faces(self, path):
        with open(path) as file:
            return sum(line.startswith("f ") for line in file)

    def test_what_tracks_a_guide_goes_on(self):
        with open(self.path("rest.obj"), "w") as file:
            file.write("v 0 0 0\nv 0.2 0 0\nv 0 0.2 0\nv 0.2 0.2 0\nf 1 2 4\nf 1 4 3\n")
        self.start(TRACKED % self.path("rest.obj"), program="tracking_node")
        state = self.listen("/t/state", ClothState)
        guide = self.publisher("/t/guide/points", PointCloud2)
        for k, z in enumerate((0.0, 0.05)):
            points = [(0, 0, z), (0.2, 0, z), (0, 0.2, z), (0.2, 0.2, z)]
            header = PointCloud2().header
            header.frame_id = "world"
            guide.publish(point_cloud2.create_cloud_xyz32(header, points))
            self.arrived()
            self.states_after(state, 2)
        self.done("remove", "other")   # which was before it
        self.done("spawn", "obstacles: [{name: ball, shape: {sphere: {radius: 0.1}}, pose: {position: [0, 0, -3]}}]")
        arrived = self.states_after(state, 60)   # without another message
        self.assertEqual(arrived.names, ["flap"])
        self.assertAlmostEqual(sum(v.z for v in arrived.vertices) / len(arrived.vertices), 0.05, delta=1e-3)
        self.refused("spawn", "tracked: [{}]", "from its start")

    def test_another_kind_of_object(self):
        self.start(ROPE)
        state = self.listen("/t/state", RodState)
        self.states_after(state, 10)
        self.done("spawn", SECOND)
        rods, cloths = self.listen("/t/rods/state", RodState), self.listen("/t/cloths/state", ClothState)
        end = self.step(10).stamp
        self.assertEqual((rods.at(end).step, rods.at(end).name, cloths.at(end).names), (20, "rope", ["second"]))
        self.assertFalse(self.published("/t/state"))
        self.refused("remove", "rope", "which rod_node is for")
        self.done("remove", "second")
        wait_until(lambda: self.published("/t/state") and not self.published("/t/rods/state"),
                   what="the topics of before")
        wait_until(state.connected, what="the topic of before")
        self.states_after(state, 10)

    def test_threads(self):
        self.start(HONEY, program="thread_node")
        state = self.listen("/t/state", ThreadState)
        flow = self.publisher("/t/nozzle/flow", Float64)
        flow.publish(0.0)
        self.arrived()
        self.states_after(state, 20)
        self.done("spawn", "threads: [{name: glue, nozzle: {position: [0.1, 0, 0.03], diameter: 0.005, flow: 6.0e-7}}]")
        nozzle = self.listen("/t/threads/honey/nozzle/wrench", WrenchStamped)
        stamp = self.step(20).stamp
        wait_until(lambda: nozzle.count() >= 20, what="wrenches on the first nozzle, under its new name")
        self.assertEqual({m.name for m in state.all_at(stamp, 2)}, {"honey", "glue"})
        honey = [m for m in state.all() if m.name == "honey"]
        self.assertEqual(len(honey[-1].nodes), len(honey[-20].nodes))   # its flow is still that of the message
        self.assertFalse(self.published("/t/nozzle/wrench"))
        self.done("set_parameter", "threads.honey.fluid.viscosity=50")
        self.done("remove", "glue")
        wait_until(lambda: self.published("/t/nozzle/wrench"), what="its first name")
        self.step(5)

    def swing(self, guide, seconds, height=1.0):
        rate = rospy.Rate(100)
        for _ in range(int(100 * seconds)):
            self.phase += 0.05
            guide.publish(pose(1, 0.1 * math.sin(self.phase), height, rospy.get_time()))
            rate.sleep()

    def raw(self, bag):
        return [(topic, bytes(raw[1]), stamp)
                for topic, raw, stamp in rosbag.Bag(self.path(bag)).read_messages(raw=True)]

    def test_a_replay_repeats_the_edits(self):
        node = self.start(ROPE, pace="wall", guide_delay=0.05, max_lag=0.5, record_bag=self.path("run.bag"))
        state = self.listen("/t/state", RodState)
        right = self.publisher("/t/grasps/right/pose", PoseStamped)
        self.phase = 0.0
        self.swing(right, 0.6)
        self.done("spawn", BALL % 1.05)
        self.swing(right, 0.5)
        self.done("attach", "rope: {hand: {nodes: [4, 5], motion: {topic: true}, attach: initial}}")
        hand = self.publisher("/t/grasps/hand/pose", PoseStamped)
        self.swing(hand, 0.4)
        self.done("set_parameter", "rods.rope.material.youngs_modulus=3e6\nrods.rope.damping.mass=1")
        self.refused("spawn", BALL % 1.05, "is also the name of")   # leaves no trace
        self.swing(right, 0.3)
        self.assertTrue(self.call("pause", SetBool, True).success)
        self.done("detach", "hand")
        self.assertTrue(self.call("pause", SetBool, False).success)
        self.swing(right, 0.3)
        self.done("remove", "ball")
        self.swing(right, 0.3)
        self.assertTrue(self.call("reset", Trigger).success)
        self.swing(right, 0.5)
        wait_until(lambda: state.last().epoch == 1 and state.last().step > 50, what="states after the reset")
        node.terminate()
        self.assertEqual(node.wait(60), 0, self.output("rod.err"))
        with rosbag.Bag(self.path("run.bag")) as bag:
            edits = [m.kind for _, m, _ in bag.read_messages(topics=["/t/inputs"]) if m.kind >= Input.SPAWN]
            scenes = [m.data for _, m, _ in bag.read_messages(topics=["/t/scene"])]
        self.assertEqual(edits, [Input.SPAWN, Input.ATTACH, Input.SET_PARAMETER, Input.DETACH, Input.REMOVE])
        self.assertEqual(len(scenes), 6)
        self.assertEqual(scenes[0], ROPE)
        first = self.raw("run.bag")
        node = self.start("", wait=False, pace="fast", replay=self.path("run.bag"), record_bag=self.path("again.bag"))
        self.assertEqual(node.wait(200), 0, self.output("rod.err"))
        again = self.raw("again.bag")
        self.assertEqual(len(first), len(again))
        for k, (a, b) in enumerate(zip(first, again)):
            self.assertEqual(a, b, "message %d on %s at %s" % (k, a[0], a[2]))
        self.start("", replay=self.path("run.bag"), start_time=0.0, record_bag="")
        self.refused("spawn", BALL % 3, "takes no other input")


if __name__ == "__main__":
    run("edits_test", Edits)
