#!/usr/bin/python3
"""cloth_node: grippers and wind by message, wrenches, mesh and points, bad meshes and bad messages."""
import math
import os

import rospy
from geometry_msgs.msg import PoseArray, PoseStamped, Vector3Stamped, WrenchStamped
from sensor_msgs import point_cloud2
from sensor_msgs.msg import PointCloud2
from slender_sim.msg import ClothState, MeshStamped
from slender_sim.srv import FilePath, SetGrasp, SetGraspRequest
from std_srvs.srv import Trigger
from visualization_msgs.msg import MarkerArray

from node_harness import NodeCase, fill, pose, run, wait_until

STEP = 0.01
WEIGHT = 9.81 * 0.4 * 0.3 * 0.2      # N
SCENE = """
name: towel
time: {step: 0.01, duration: 1}
wind: {topic: true}
cloths:
  - name: towel
    grid: {corner: [0, 0, 1], sides: [[0.4, 0, 0], [0, 0.3, 0]], cells: [8, 6], pattern: alternating}
    material: {area_density: 0.2, thickness: 0.0004, youngs_modulus: 2.0e5}
    damping: {mass: 8, drag: 0.8}
    grasps:
      left: {near: {point: [0, 0.15, 1], radius: 0.06}, motion: {topic: true}}
      right: {near: {point: [0.4, 0.15, 1], radius: 0.06}, motion: {topic: true}}
"""


def wind(x, y, z, frame="world"):
    message = Vector3Stamped()
    message.header.frame_id = frame
    message.vector.x, message.vector.y, message.vector.z = x, y, z
    return message


def numbers(state):
    return [c for p in list(state.vertices) + list(state.velocities) for c in (p.x, p.y, p.z)]


class Cloth(NodeCase):

    def begin(self, scene=SCENE, **parameters):
        self.start(scene, program="cloth_node", **parameters)
        self.states = self.listen("/t/state", ClothState)

    def after(self, n):
        return self.states_after(self.states, n)

    def test_two_grippers_lift_it(self):
        self.begin()
        left, right = [self.publisher("/t/grasps/%s/pose" % name, PoseStamped) for name in ("left", "right")]
        wrenches = [self.listen("/t/grasps/%s/wrench" % name, WrenchStamped) for name in ("left", "right")]
        start = self.after(1)
        q = (0.0, 0.0, 0.0, 1.0)
        for k in range(2, 52):           # 0.3 m upwards and 0.1 m together within half a second, each from where the gripper is
            f = (k - 1) / 50.0
            left.publish(pose(7 + 0.05 * f, 0, 0.3 * f, stamp=1.0 + STEP * k, q=q))
            right.publish(pose(-7 - 0.05 * f, 3, 0.3 * f, stamp=1.0 + STEP * k, q=q))
        self.arrived()
        state = self.after(700)
        held = [i for i, v in enumerate(start.vertices) if abs(v.x) < 1e-9 and 0.05 < v.y < 0.25]
        self.assertGreater(len(held), 0)
        for i in held:                   # attach: initial; the first pose is at f = 1/50
            self.assertAlmostEqual(state.vertices[i].x - start.vertices[i].x, 0.049, delta=1e-6)
            self.assertAlmostEqual(state.vertices[i].z - start.vertices[i].z, 0.294, delta=1e-6)
        forces = [wrench.at(state.header.stamp).wrench.force for wrench in wrenches]
        self.assertAlmostEqual(forces[0].z + forces[1].z, -WEIGHT, delta=2e-3 * WEIGHT)
        self.assertAlmostEqual(forces[0].x + forces[1].x, 0.0, delta=2e-3 * WEIGHT)
        self.assertAlmostEqual(forces[0].z, forces[1].z, delta=0.02 * WEIGHT)
        self.assertGreater(forces[0].x, 0.0)                # the cloth draws the grippers together
        self.assertLess(forces[1].x, 0.0)
        self.assertLess(min(v.z for v in state.vertices), 1.25)

    def test_guides_and_turning(self):
        self.begin()
        guides = self.publisher("/t/guides", PoseArray)
        start = self.after(1)
        turned = [pose(0, 0, 0).pose, pose(0, 0, 0).pose]
        for k in range(2, 103):          # a right angle about x
            angle = 0.5 * 1.5707963267948966 * (k - 2) / 100.0
            message = PoseArray()
            message.header.frame_id = "world"
            message.header.stamp = rospy.Time.from_sec(1.0 + STEP * k)
            for p in turned:
                fill(p, (0, 0, 0), (math.sin(angle), 0, 0, math.cos(angle)))
            message.poses = turned
            guides.publish(message)
        self.arrived()
        state = self.after(110)
        held = [i for i, v in enumerate(start.vertices) if abs(v.x) < 1e-9 and abs(v.y - 0.15) < 0.06]
        self.assertEqual(len(held), 3)
        for i in held:                   # about the world's origin: y -> z, z -> -y, and z was 1
            self.assertAlmostEqual(state.vertices[i].y, -start.vertices[i].z, delta=1e-6)
            self.assertAlmostEqual(state.vertices[i].z, start.vertices[i].y, delta=1e-6)
        message.poses = turned[:1]
        guides.publish(message)
        self.expect_drop("wrong_length")

    def test_wind_by_message(self):
        self.begin()
        air = self.publisher("/t/wind", Vector3Stamped)
        wrench = self.listen("/t/grasps/left/wrench", WrenchStamped)
        still = self.after(300)
        calm = wrench.at(still.header.stamp).wrench.force
        self.assertAlmostEqual(calm.y, 0.0, delta=0.02 * WEIGHT)
        air.publish(wind(0, 6, 0))
        self.arrived()
        blown = self.after(200)
        self.assertGreater(sum(v.y for v in blown.vertices), sum(v.y for v in still.vertices) + 0.5)
        self.assertGreater(wrench.at(blown.header.stamp).wrench.force.y, 0.05 * WEIGHT)
        for bad in (wind(float("nan"), 0, 0), wind(1, 0, 0, frame=""), wind(1, 0, 0, frame="nowhere"), wind(0, 0, 1e5)):
            air.publish(bad)
        for reason in ("not_finite", "bad_frame", "no_transform", "out_of_range"):
            self.expect_drop(reason)
        self.assertEqual(self.diagnostics("inputs")["wind [m/s]"], "0 6 0")

    def test_bad_poses_are_dropped(self):
        self.begin()
        left = self.publisher("/t/grasps/left/pose", PoseStamped)
        before = self.after(1)
        left.publish(pose(float("inf"), 0, 0, stamp=1.02))
        left.publish(pose(0, 0, 0, stamp=1.02, q=(0, 0, 0, 2)))
        left.publish(pose(1e300, 0, 0, stamp=1.02))
        left.publish(pose(0, 0, 0, stamp=1.02, frame="nowhere"))
        for reason in ("not_finite", "bad_quaternion", "out_of_range", "no_transform"):
            self.expect_drop(reason)
        after = self.after(5)
        held = [i for i, v in enumerate(before.vertices) if abs(v.x) < 1e-9 and abs(v.y - 0.15) < 0.06]
        for i in held:
            self.assertEqual(after.vertices[i].z, before.vertices[i].z)

    def test_mesh_points_markers(self):
        second = SCENE.split("cloths:\n")[1].replace("towel", "napkin").replace("point: [0", "point: [1").replace("[0, 0, 1]", "[1, 0, 1]").replace("left", "a").replace("right", "b")
        self.begin(SCENE + second)
        markers = self.listen("/t/markers", MarkerArray)
        points = self.listen("/t/points", PointCloud2)
        state = self.after(20)
        mesh = rospy.wait_for_message("/t/mesh", MeshStamped, 60)          # latched: this subscriber is late
        self.assertEqual(list(mesh.names), ["towel", "napkin"])
        self.assertEqual(list(state.names), ["towel", "napkin"])
        self.assertEqual(list(state.offsets), [0, 63])
        self.assertEqual(list(mesh.vertex_offsets), [0, 63])
        self.assertEqual(list(mesh.triangle_offsets), [0, 96])
        self.assertEqual(len(mesh.triangles), 3 * 192)
        self.assertEqual(len(state.vertices), 126)
        self.assertEqual(len(state.velocities), 126)
        self.assertTrue(all(t < 63 for t in mesh.triangles[:3 * 96]) and all(63 <= t < 126 for t in mesh.triangles[3 * 96:]))
        self.assertAlmostEqual(mesh.vertices[63].x, 1.0, places=12)        # undeformed
        cloud = list(point_cloud2.read_points(points.at(state.header.stamp), ("x", "y", "z")))
        for p, v in zip(cloud, state.vertices):
            self.assertAlmostEqual(p[2], v.z, places=6)
        wait_until(lambda: markers.count() > 0, what="markers")
        drawn = {(m.ns, m.id): m for m in markers.last().markers}
        self.assertEqual(len(drawn[("cloths/napkin", 0)].points), 3 * 96)
        self.assertEqual(len(drawn[("cloths/napkin", 0)].colors), 3 * 96)
        self.assertEqual(len(drawn[("grasps", 0)].points), 4)
        self.assertEqual(int(self.diagnostics("simulation")["vertices"]), 126)

    def test_services(self):
        self.begin()
        self.after(20)
        self.assertTrue(self.call("save_state", FilePath, self.path("state")).success)
        later = [numbers(self.after(1)) for _ in range(10)]
        self.assertTrue(self.call("load_state", FilePath, self.path("state")).success)
        self.assertEqual([numbers(self.after(1)) for _ in range(10)], later)
        self.assertTrue(self.call("set_grasp", SetGrasp, SetGraspRequest(name="left", action=SetGraspRequest.RELEASE)).success)
        released = self.after(30)
        request = SetGraspRequest(name="left", action=SetGraspRequest.ATTACH_WITHIN, max_distance=0.08)
        request.point = released.vertices[0]
        answer = self.call("set_grasp", SetGrasp, request)
        self.assertTrue(answer.success, answer.message)
        self.assertEqual(answer.first_node, 0)
        self.assertGreater(answer.last_node, 0)
        self.assertEqual(self.after(5).vertices[0], released.vertices[0])
        request.position_only = True
        self.assertFalse(self.call("set_grasp", SetGrasp, request).success)
        self.call("reset", Trigger)
        self.assertEqual(self.after(1).epoch, 2)

    def refused(self, scene, *words):
        process = self.start(scene, wait=False, program="cloth_node")
        self.assertEqual(process.wait(60), 2)
        text = self.output("rod.err")
        for word in words:
            self.assertIn(word, text)

    def test_bad_meshes_are_refused_by_name(self):
        square = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"
        meshes = {"needle.obj": (square + "v 2 0 0\nf 1 2 3\nf 1 3 4\nf 1 2 5\n", "face 2"),
                  "fan.obj": (square + "v 0.5 0.5 1\nf 1 2 3\nf 1 3 4\nf 1 3 5\n", "the edge between vertices 0 and 2"),
                  "twice.obj": (square + "v 1 1 0\nf 1 2 3\nf 1 5 4\n", "vertices 2 and 4")}
        for name, (text, word) in sorted(meshes.items()):
            with open(self.path(name), "w") as file:
                file.write(text)
            scene = os.path.join(self.folder, "scene.yaml")
            with open(scene, "w") as file:
                file.write("name: bad\ncloths:\n  - mesh: {file: %s}\n" % name)
            self.refused(scene, "scene.yaml:3: cloths.0.mesh.file = " + name, name + ": ", word)

    def test_refuses_other_scenes(self):
        self.refused("name: rope\nrods: [{}]\n", "which cloth_node is for; scene_node runs every scene")
        self.refused("name: none\nbodies: [{mass: 1, inertia: [1, 1, 1]}]\n",
                     "it has no cloths, which cloth_node is for")


if __name__ == "__main__":
    run("cloth_test", Cloth)
