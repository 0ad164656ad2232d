#!/usr/bin/python3
"""The ROS commands of docs/tutorials.md, word by word from the text, and what the text says will be seen. Only rviz, which needs a display, is left out.

The scenes and the commands of `simulate` are run by test/scenes/tutorials.cpp.
"""
import math
import os
import re
import shutil
import signal
import subprocess
import tempfile
import unittest

import rosbag
import rospkg
import rospy
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import Point, PoseStamped, WrenchStamped
from sensor_msgs import point_cloud2
from sensor_msgs.msg import PointCloud2
from slender_sim.msg import ClothState, RodState, ThreadState
from slender_sim.srv import SetGrasp
from std_msgs.msg import Float64, Header, String

from node_harness import Listener, run, wait_until

with open(os.path.join(rospkg.RosPack().get_path("slender_sim"), "docs", "tutorials.md")) as file:
    TEXT = file.read()


def wait_for(condition, what):
    """roslaunch looks through the whole package for what it starts, and a busy machine may take minutes for that."""
    wait_until(condition, timeout=300.0, what=what)


def only(pattern, text=TEXT):
    """The one place of the text that matches: a tutorial that says it otherwise needs another test."""
    found = re.findall(pattern, text, re.DOTALL)
    if len(found) != 1:
        raise AssertionError("%d places match %s" % (len(found), pattern))
    return found[0]


def scene(name):
    return only(r"`%s\.yaml`[^\n]*:\n\n```yaml\n([^`]*)```" % name)


def commands(start):
    """The command lines of the text that begin so: indented, and continued where a line ends with a backslash or within quotes."""
    return re.findall(r"\n    (%s[^\n]*(?:\n      [^\n]*)*)" % re.escape(start), TEXT)


def command(start):
    """The one command line that begins so."""
    found = commands(start)
    if len(found) != 1:
        raise AssertionError("%d commands begin with %s" % (len(found), start))
    return found[0]


def launch_command(name):
    """The first `roslaunch ... scene:=$PWD/NAME.yaml ...` without rviz."""
    return [line for line in commands("roslaunch slender_sim ") if "scene:=$PWD/%s.yaml" % name in line][0].replace(" rviz:=true", "")


class Tutorials(unittest.TestCase):

    def setUp(self):
        self.folder = tempfile.mkdtemp(prefix="slender_sim_tutorials_")
        self.processes, self.ends = [], []

    def tearDown(self):
        for end in self.ends:
            end.unregister()
        for process in self.processes:
            self.stop(process)
        shutil.rmtree(self.folder, ignore_errors=True)

    def path(self, name):
        return os.path.join(self.folder, name)

    def write(self, name, text):
        with open(self.path(name), "w") as file:
            file.write(text)

    def shell(self, command):
        """Runs a command line of the text in its own process group, in the folder of the tutorial."""
        process = subprocess.Popen(["bash", "-c", command], cwd=self.folder, preexec_fn=os.setsid, stdout=open(self.path("out.txt"), "w"),
                                   stderr=subprocess.STDOUT)
        self.processes.append(process)
        return process

    def stop(self, process):
        """As Ctrl-C does, of the whole group."""
        for which in (signal.SIGINT, signal.SIGKILL):
            if process.poll() is None:
                os.killpg(process.pid, which)
            try:
                process.wait(60)
                return
            except subprocess.TimeoutExpired:
                pass

    def done(self, command):
        result = subprocess.run(["bash", "-c", command], cwd=self.folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, universal_newlines=True)
        self.assertEqual(result.returncode, 0, command + "\n" + result.stdout)
        return result.stdout

    def output(self):
        with open(self.path("out.txt")) as file:
            return file.read()

    def listen(self, topic, kind):
        listener = Listener(topic, kind)
        self.ends.append(listener.subscriber)
        return listener

    def see(self, listener, condition, what):
        wait_for(lambda: listener.count() > 0 and condition(listener.last()), what)
        return listener.last()

    def bag_lists(self, command, topics):
        """`rosbag info NAME.bag` of the text, or the same of another bag."""
        text = self.done(command)
        for topic in topics:
            self.assertRegex(text, r"%s\s+\d+ msgs?" % topic)

    def test_rope(self):
        self.write("rope.yaml", scene("rope"))
        self.assertIn(" record_bag:=$PWD/rope.bag", launch_command("rope"))
        node = self.shell(launch_command("rope"))
        state = self.listen("/state", RodState)
        first = self.see(state, lambda m: True, "/state").nodes[0]
        self.assertAlmostEqual(first.y, 0.0, 9)   # nobody moves it yet
        mover = self.shell(command("rostopic pub -r 20 -s /grasps/gripper/pose"))
        moved = self.see(state, lambda m: abs(m.nodes[0].y - 0.2) < 1e-6, "the gripper to be at y = 0.2 m")
        self.assertAlmostEqual(moved.nodes[0].z, 1.0, 6)
        # every message has its own stamp: none is dropped as stale, and the input stays young
        diagnostics = self.listen("/diagnostics", DiagnosticArray)
        values = {}

        def young():
            for status in diagnostics.last().status if diagnostics.count() else []:
                values.update({value.key: value.value for value in status.values})
            return float(values.get("input age gripper [s]", "9").replace("none yet", "9")) < 0.5 and "real-time factor" in values

        rospy.sleep(2.0)
        wait_for(young, "diagnostics of a young input")
        self.assertEqual(values["dropped stale"], "0")
        wrench = self.listen("/grasps/gripper/wrench", WrenchStamped)
        self.see(wrench, lambda m: abs(m.wrench.force.z) > 0.01, "the rope's weight on the gripper")
        self.stop(mover)
        self.stop(node)
        self.bag_lists(command("rosbag info rope.bag"), ["/state", "/scene", "/grasps/gripper/wrench"])

    def test_table_and_film(self):
        """The gripper goes 0.3 m aside and back. The film has a picture for each 0.04 s."""
        self.write("rope.yaml", scene("rope"))
        self.done(command("rosrun slender_sim simulate rope.yaml --bag "))
        with rosbag.Bag(self.path("table.bag")) as bag:
            places = [message.nodes[0].y for _, message, _ in bag.read_messages("/state")]
        self.assertEqual(len(places), 801)
        self.assertAlmostEqual(max(places), 0.3, 9)
        self.assertAlmostEqual(places[-1], 0.0, 9)
        self.done(command("rosrun slender_sim bag_to_video table.bag "))
        self.assertGreater(os.path.getsize(self.path("rope.mp4")), 10000)

    def test_stiffer_rope(self):
        self.write("rope.yaml", scene("rope"))
        stiffer = [line for line in commands("roslaunch slender_sim rod.launch") if "youngs_modulus=1e8" in line]
        self.assertEqual(len(stiffer), 1)
        self.shell(stiffer[0].replace(" rviz:=true", ""))
        text = self.listen("/scene", String)
        self.see(text, lambda m: "youngs_modulus: 1e8" in m.data, "the overridden scene")
        self.see(self.listen("/state", RodState), lambda m: m.step > 10, "steps of the stiffer rope")

    def test_film_of_the_cable(self):
        self.write("cable.yaml", scene("cable"))
        self.done(command("rosrun slender_sim simulate cable.yaml --bag "))
        self.done(command("rosrun slender_sim bag_to_video cable.bag "))
        self.assertGreater(os.path.getsize(self.path("cable.mp4")), 10000)

    def test_cable_moved_by_messages(self):
        self.write("cable.yaml", scene("cable"))
        self.assertIn(" record_bag:=$PWD/live.bag", launch_command("cable"))
        node = self.shell(launch_command("cable"))
        state = self.listen("/state", RodState)
        first = self.see(state, lambda m: True, "/state").nodes[-1]
        self.assertAlmostEqual(first.y, 0.0, 6)   # nobody moves it yet
        mover = self.shell(command("rostopic pub -r 20 -s /grasps/right/pose"))
        self.see(state, lambda m: abs(m.nodes[-1].y - 0.2) < 1e-6, "the right end at y = 0.2 m")
        filtered = self.listen("/grasps/right/wrench_filtered", WrenchStamped)
        self.see(filtered, lambda m: abs(m.wrench.force.z + 0.72) < 0.05, "half of the cable's weight on the gripper")
        self.stop(mover)
        self.stop(node)
        self.bag_lists("rosbag info live.bag", ["/state", "/scene", "/grasps/right/wrench"])

    def test_cable_moved_by_a_frame(self):
        self.write("cable.yaml", scene("cable"))
        self.write("gripper_frame.py", only(r"`gripper_frame\.py`[^\n]*:\n\n```python\n([^`]*)```"))
        followers = [line for line in commands("roslaunch slender_sim rod.launch") if "{tf: gripper}" in line]
        self.assertEqual(len(followers), 1)
        node = self.shell(followers[0])
        state = self.listen("/state", RodState)
        self.see(state, lambda m: m.step > 2, "the cable")
        self.shell(command("/usr/bin/python3 gripper_frame.py"))
        self.see(state, lambda m: m.nodes[-1].y > 0.15, "the gripper on one side")
        self.see(state, lambda m: m.nodes[-1].y < -0.15, "the gripper on the other side")
        self.stop(node)
        self.bag_lists("rosbag info tf.bag", ["/state", "/scene"])

    def test_honey(self):
        self.write("honey.yaml", scene("honey"))
        node = self.shell(launch_command("honey"))
        state = self.listen("/state", ThreadState)
        self.see(state, lambda m: min(p.z for p in m.nodes) < 0.03, "honey that falls")
        self.stop(node)
        self.bag_lists("rosbag info honey.bag", ["/state", "/scene"])

    def test_driven_nozzle(self):
        flow, motion, replaced = only(r"With `(flow: \{topic: true[^`]*)` and\s+`(motion: \{topic: true\})`\s+in\s+place\s+of\s+`(swirl: 0\.3)`\s+in\s+`nozzle`")
        text = scene("honey")
        self.assertIn("flow: 4.0e-7, " + replaced, text)
        self.write("honey.yaml", text.replace("flow: 4.0e-7, " + replaced, flow + ", " + motion))
        node = self.shell(launch_command("honey"))
        state = self.listen("/state", ThreadState)
        self.see(state, lambda m: m.step > 2, "the thread")
        rate = rospy.Publisher("/nozzle/flow", Float64, queue_size=1)
        where = rospy.Publisher("/nozzle/pose", PoseStamped, queue_size=10)
        self.ends += [rate, where]
        wait_for(lambda: rate.get_num_connections() > 0 and where.get_num_connections() > 0, "nozzle/flow and nozzle/pose to be heard")
        rate.publish(0.0)
        pose = PoseStamped()
        pose.header.frame_id = "world"
        pose.pose.position = Point(0.01, 0, 0.06)
        pose.pose.orientation.y = pose.pose.orientation.w = math.sqrt(0.5)   # x along the flow: down

        def moved():
            pose.header.stamp = rospy.Time.now()
            where.publish(pose)
            return abs(state.last().nodes[-1].x - 0.01) < 1e-6

        wait_for(moved, "the nozzle to be at x = 0.01 m")
        self.stop(node)

    def test_sweep(self):
        """The first run of the map ends; the whole map takes long."""
        line = command("rosrun slender_sim sweep ")
        self.assertIn("--out out/map", line)
        sweep = self.shell(line)

        def begun():
            self.assertIsNone(sweep.poll(), self.output())
            return os.path.isdir(self.path("out/map")) and any(files for _, _, files in os.walk(self.path("out/map")))

        wait_for(begun, "results of the sweep")
        self.stop(sweep)

    def test_cloth(self):
        grasps = only(r"`(grasps: \{hand: \{corner: lower_left, motion: \{topic: true\}\}\})`")
        self.write("cloth.yaml", scene("cloth").rstrip() + "\n    " + grasps + "\n")
        node = self.shell(launch_command("cloth"))
        state = self.listen("/state", ClothState)
        self.see(state, lambda m: m.step > 2, "the handkerchief")
        held = state.all()[0].vertices[0]
        # "drive /grasps/hand/pose as above": the command for the gripper, with the hand's topic and pose. Poses of cloths count relative to the first one.
        pose = command("rostopic pub -r 20 -s /grasps/gripper/pose").replace("gripper", "hand")
        mover = self.shell(pose)
        sent = self.listen("/grasps/hand/pose", PoseStamped)
        diagnostics = self.listen("/diagnostics", DiagnosticArray)

        def heard():   # the first pose that the node takes in is what later ones count from
            values = {value.key: value.value for status in diagnostics.last().status for value in status.values}
            return values.get("input age hand [s]", "none yet") != "none yet"
        wait_for(lambda: sent.count() > 40 and diagnostics.count() > 0 and heard(), "two seconds of poses")
        self.stop(mover)
        self.shell(pose.replace("y: 0.2", "y: 0.3"))
        self.see(state, lambda m: abs(m.vertices[0].y - held.y - 0.1) < 1e-6, "the corner 0.1 m further")
        self.assertIn("success: True", self.done(command("rosservice call /cloth_node/set_grasp ")))
        self.see(state, lambda m: m.vertices[0].z < held.z - 0.05, "the corner that was let go")
        self.stop(node)
        self.bag_lists("rosbag info cloth.bag", ["/state", "/scene", "/mesh"])

    def test_tracked(self):
        self.write("tracked.yaml", scene("tracked"))
        node = self.shell(launch_command("tracked"))
        state = self.listen("/state", ClothState)
        self.see(state, lambda m: m.step > 2, "the sheet")
        points = rospy.Publisher("/guide/points", PointCloud2, queue_size=10)
        self.ends.append(points)
        wait_for(lambda: points.get_num_connections() > 0, "guide/points to be heard")

        def follows():
            header = Header(stamp=rospy.Time.now(), frame_id="world")
            points.publish(point_cloud2.create_cloud_xyz32(header, [(x, y, 0.3) for y in (-0.25, 0.25) for x in (-0.25, 0.25)]))
            message = state.last()
            return len(message.guide_vertices) == 4 and all(abs(p.z - 0.3) < 1e-6 for p in message.guide_vertices)

        wait_for(follows, "the guide at z = 0.3 m")
        message = state.last()
        self.assertLess(max(message.constraint_errors), 1e-12)   # round-off
        mean = sum(p.z for p in message.vertices) / len(message.vertices)
        self.assertAlmostEqual(mean, 0.3, 1)   # the sheet is where the guide is; folds and sway are its own
        # The guide stops the rising sheet first, with forces that point down. Then it bears the weight.
        self.see(state, lambda m: sum(f.z for f in m.guide_forces) > 0.0, "forces that bear the weight")
        self.stop(node)
        self.bag_lists("rosbag info tracked.bag", ["/state", "/scene", "/mesh"])
        self.done(command("rosrun slender_sim regions tracked.yaml out.ply"))
        self.assertGreater(os.path.getsize(self.path("out.ply")), 1000)


if __name__ == "__main__":
    run("tutorials_test", Tutorials)
