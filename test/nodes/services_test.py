#!/usr/bin/python3
"""Services of rod_node (success and refusal), paces, and how it fails."""
import math
import os
import threading

import rosgraph
import rospy
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import Point, PoseStamped, WrenchStamped
from node_harness import SCENE, NodeCase, numbers, pose, run, status_of, wait_until
from rosgraph_msgs.msg import Clock
from slender_sim.msg import RodState
from slender_sim.srv import FilePath, SetGrasp, SetGraspRequest, Step
from std_srvs.srv import SetBool, Trigger


class Services(NodeCase):

    def test_step_returns_after_publishing(self):
        self.start()
        state = self.listen("/t/state", RodState)
        answer = self.step(7)
        self.assertEqual(answer.step, 7)
        self.assertEqual(answer.stamp.to_nsec(), 1000000000 + 7 * 5000000)
        wait_until(lambda: state.count() == 7, what="7 states")
        self.assertFalse(self.call("step", Step, 0).success)

    def test_step_is_refused_while_running(self):
        self.start(pace="wall")
        answer = self.call("step", Step, 1)
        self.assertFalse(answer.success)
        self.assertIn("pause", answer.message)

    def test_pause_holds_the_step(self):
        self.start(pace="wall")
        state = self.listen("/t/state", RodState)
        wait_until(lambda: state.count() > 10, what="states")
        self.assertTrue(self.call("pause", SetBool, True).success)
        step = int(self.diagnostics("simulation")["step"])
        wait_until(lambda: state.last().step == step, what="the last state before the pause")
        held = state.last()
        count = state.count()
        rospy.sleep(0.5)
        self.assertEqual(state.count(), count)
        answer = self.call("step", Step, 2)   # a paused node can be stepped
        self.assertTrue(answer.success)
        self.assertEqual(answer.step, held.step + 2)
        self.assertTrue(self.call("pause", SetBool, False).success)
        wait_until(lambda: state.count() > count + 10, what="states after the pause")
        after = state.all()[count:]
        self.assertEqual([m.step for m in after], list(range(held.step + 1, held.step + 1 + len(after))))
        stamps = [m.header.stamp for m in state.all()]
        self.assertTrue(all(a < b for a, b in zip(stamps, stamps[1:])))

    def test_wall_pace_keeps_real_time(self):
        self.start(pace="wall")
        state = self.listen("/t/state", RodState)
        wait_until(lambda: state.count() > 0, what="a state")
        begin = state.last().header.stamp
        wait_until(lambda: (state.last().header.stamp - begin).to_sec() > 2.0, what="two simulated seconds")
        # a node that runs ahead never gets there; a busy machine may need some time
        wait_until(lambda: abs(state.last().header.stamp.to_sec() - rospy.get_time()) < 0.2, what="a state of now")

    def test_reset(self):
        self.start()
        state = self.listen("/t/state", RodState)
        self.step(40)
        wait_until(lambda: state.last().step == 40, what="step 40")   # early ones may be lost
        self.assertTrue(self.call("reset", Trigger).success)
        wait_until(lambda: state.last().epoch == 1, what="the state after the reset")
        first, fresh = state.all()[-2:]
        self.assertEqual((fresh.epoch, fresh.step), (1, 0))
        self.assertGreater(fresh.header.stamp, first.header.stamp)
        self.assertTrue(all(abs(p.z - 1) < 1e-12 for p in fresh.nodes))
        again = self.states_after(state, 40)
        self.assertEqual(numbers(again), numbers(first))

    def test_save_and_load_are_exact(self):
        self.start()
        state = self.listen("/t/state", RodState)
        self.step(30)
        file = self.path("saved")
        answer = self.call("save_state", FilePath, file)
        self.assertTrue(answer.success)
        self.assertEqual(answer.message, "saved " + file)
        onwards = self.states_after(state, 30)
        answer = self.call("load_state", FilePath, file)
        self.assertTrue(answer.success, answer.message)
        again = self.states_after(state, 30)
        self.assertEqual(numbers(again), numbers(onwards))
        self.assertEqual((again.step, again.epoch), (60, 1))
        self.assertGreater(again.header.stamp, onwards.header.stamp)

    def test_relative_paths_are_told_in_full(self):
        self.start()   # the node's working directory is that of the test
        self.step(3)
        name = "slender_sim_relative_%d" % os.getpid()
        try:
            answer = self.call("save_state", FilePath, name)
            self.assertTrue(answer.success, answer.message)
            self.assertEqual(answer.message, "saved " + os.path.abspath(name))
            answer = self.call("load_state", FilePath, "./" + name)
            self.assertTrue(answer.success, answer.message)
            self.assertEqual(answer.message, "loaded " + os.path.abspath(name))
        finally:
            if os.path.exists(name):
                os.remove(name)

    def test_save_and_load_refuse(self):
        self.start()
        self.step(3)
        self.assertFalse(self.call("save_state", FilePath, "/nowhere/at/all").success)
        self.assertFalse(self.call("save_state", FilePath, "").success)
        os.mkfifo(self.path("fifo"))
        self.assertFalse(self.call("save_state", FilePath, self.path("fifo")).success)
        for path in ("", self.path("missing"), __file__, self.path("fifo")):   # of a FIFO it would wait for ever
            answer = self.call("load_state", FilePath, path)
            self.assertFalse(answer.success)
            self.assertTrue(answer.message)
        self.assertEqual(self.step(1).step, 4)   # the state was left alone

    def set_grasp(self, name, action, first=0, last=0, point=None, max_distance=0.0, position_only=False):
        return self.call("set_grasp", SetGrasp, SetGraspRequest(name, action, first, last, point or Point(), max_distance, position_only))

    def test_set_grasp(self):
        self.start()
        state = self.listen("/t/state", RodState)
        wrench = self.listen("/t/grasps/right/wrench", WrenchStamped)
        self.step(10)
        release, nodes, nearest = SetGraspRequest.RELEASE, SetGraspRequest.ATTACH_NODES, SetGraspRequest.ATTACH_NEAREST
        self.assertFalse(self.set_grasp("middle", release).success)
        self.assertFalse(self.set_grasp("right", nodes, 4, 4).success)      # holds already
        self.assertTrue(self.set_grasp("right", release).success)
        self.assertFalse(self.set_grasp("right", release).success)
        self.assertIn("grasp left", self.set_grasp("right", nodes, 0, 2).message)
        fallen = self.states_after(state, 60)
        self.assertLess(fallen.nodes[-1].z, 0.8)
        force = wrench.at(fallen.header.stamp).wrench.force
        self.assertEqual((force.x, force.y, force.z), (0, 0, 0))
        for bad in ((nodes, -1, 3), (nodes, 5, 21), (nodes, -22, 0), (nodes, 0, 2), (9, 0, 0)):
            answer = self.set_grasp("right", *bad)
            self.assertFalse(answer.success)
            self.assertTrue(answer.message)
        self.assertFalse(self.set_grasp("right", nodes, 4, 6, position_only=True).success)
        self.assertFalse(self.set_grasp("right", nearest, point=Point(9, 9, 9), max_distance=0.5).success)
        self.assertFalse(self.set_grasp("right", nearest, point=Point(float("nan"), 9, 9)).success)

        answer = self.set_grasp("right", nodes, -3, -1)
        self.assertTrue(answer.success, answer.message)
        self.assertEqual((answer.first_node, answer.last_node), (18, 20))
        held = self.states_after(state, 100)
        for a, b in zip(held.nodes[18:], fallen.nodes[18:]):
            self.assertLess(math.dist((a.x, a.y, a.z), (b.x, b.y, b.z)), 1e-9)

        self.assertTrue(self.set_grasp("right", release).success)
        here = held.nodes[12]
        answer = self.set_grasp("right", nearest, point=Point(here.x, here.y, here.z + 0.001), max_distance=0.01, position_only=True)
        self.assertTrue(answer.success, answer.message)
        self.assertEqual((answer.first_node, answer.last_node), (12, 12))
        after = self.states_after(state, 50).nodes[12]
        self.assertLess(math.dist((after.x, after.y, after.z), (here.x, here.y, here.z)), 1e-9)

    def test_failed_step(self):
        """A guide that leaves for the stars: no step can follow, the node says so and waits for ~reset."""
        self.start()
        state = self.listen("/t/state", RodState)
        guide = self.publisher("/t/grasps/right/pose", PoseStamped)
        guide.publish(pose(1, 0, 1, 1.0))
        guide.publish(pose(1e6, 0, 1, 1.01))
        self.arrived()
        answer = self.call("step", Step, 20)
        self.assertFalse(answer.success)
        self.assertTrue(answer.message)
        wait_until(lambda: self.diagnostics("simulation")["level"] == 2, what="an error")
        self.assertIn("reset", self.diagnostics("simulation")["message"])
        for refused in (self.call("step", Step, 1), self.call("pause", SetBool, False)):
            self.assertFalse(refused.success)
            self.assertIn("reset", refused.message)
        self.assertTrue(all(math.isfinite(x) for m in state.all() for x in numbers(m)))
        self.assertTrue(self.call("reset", Trigger).success)
        self.assertEqual(self.step(5).step, 5)
        wait_until(lambda: self.diagnostics("simulation")["level"] == 0, what="the error to go")

    def test_reset_after_a_failure_goes_on_as_before(self):
        """A node that was paused, and stepped by hand into a failure, is paused again."""
        self.start(pace="fast", paused=True)
        guide = self.publisher("/t/grasps/right/pose", PoseStamped)
        self.step(1)
        guide.publish(pose(1, 0, 1, 1.0))
        guide.publish(pose(1e6, 0, 1, 1.01))
        self.arrived()
        self.assertFalse(self.call("step", Step, 20).success)
        self.assertTrue(self.call("reset", Trigger).success)
        wait_until(lambda: self.diagnostics("simulation")["message"] == "paused", what="the pause")
        self.assertEqual(self.step(1).step, 1)

    def test_stop_after_ends_a_long_step_too(self):
        process = self.start(stop_after=0.05)
        answer = self.call("step", Step, 100)
        self.assertFalse(answer.success)
        self.assertEqual(answer.step, 10)
        self.assertEqual(process.wait(60), 0)

    def test_tells_of_itself_during_a_long_step(self):
        self.start()
        told = self.listen("/diagnostics", DiagnosticArray)
        self.step(30000)   # about a second

        def steps():
            return [int(status_of(report, "simulation")["step"]) for report in told.all()]
        wait_until(lambda: 30000 in steps(), what="diagnostics of the end")
        self.assertTrue([s for s in steps() if 0 < s < 30000], steps())

    def test_tells_of_the_equilibrium_from_which_it_starts(self):
        node = self.start()
        self.assertNotIn("start: stable", self.diagnostics("simulation"))
        node.terminate()
        node.wait(60)
        self.start(scene=SCENE.replace("rods:", "start: equilibrium\nrods:", 1))
        told = self.diagnostics("simulation")
        self.assertEqual(told["start: stable"], "yes")
        self.assertEqual(told["start: unstable equilibria left"], "0")
        self.assertLess(float(told["start: residual"]), 1e-6)   # of the largest force; Newton's method leaves 1e-8 of an edge
        self.assertGreater(float(told["start: lowest eigenvalue [1/s^2]"]), 1.0)   # a rope of 1 m swings at several rad/s
        # as simulate --statics prints it: a weight of 0.54 N at 1 m, that sags by up to 8 cm
        self.assertAlmostEqual(float(told["start: energy [J]"]), 0.521577, delta=1e-5)

    def test_a_long_step_lets_others_in(self):
        self.start()
        answers = []
        stepping = threading.Thread(target=lambda: answers.append(self.call("step", Step, 2 ** 31)))
        stepping.start()
        wait_until(lambda: int(self.diagnostics("simulation")["step"]) > 0, what="steps")
        self.assertIn("under way", self.call("step", Step, 1).message)
        self.assertTrue(self.call("save_state", FilePath, self.path("meanwhile")).success)
        self.assertTrue(self.call("pause", SetBool, True).success)
        stepping.join(60)   # all of the steps would take a day
        self.assertFalse(stepping.is_alive())
        self.assertFalse(answers[0].success)
        self.assertIn("of 2147483648 steps; ~pause was called", answers[0].message)
        self.assertEqual(self.step(1).step, answers[0].step + 1)

    def refused(self, *needles, **parameters):
        """The node exits with 2, explains, and has advertised nothing."""
        if rospy.has_param("/t"):
            rospy.delete_param("/t")
        process = self.start(wait=False, **parameters)
        self.assertEqual(process.wait(60), 2)
        error = self.output("rod.err")
        for needle in needles:
            self.assertIn(needle, error)
        published = rosgraph.Master("/test").getSystemState()[0]
        self.assertFalse([topic for topic, nodes in published if "/t/rod" in nodes and topic != "/rosout"])

    def test_bad_scene_exits_2(self):
        self.refused("radius", scene=SCENE.replace("radius: 0.004", "radius: -1"))
        self.refused("radios", scene=SCENE.replace("radius:", "radios:"))
        self.refused("missing.yaml", scene="/nowhere/missing.yaml")
        self.refused("~scene", scene="")
        self.refused("grasp", "a-b", scene=SCENE.replace("left:", "a-b:"))

    def test_bad_parameters_exit_2(self):
        self.refused("~pace", "wall | fast | follow | step", pace="slow")
        self.refused("~state_every", state_every=0)
        self.refused("~marker_style", "tracked cloths", "choose tube or line", marker_style="regions")
        self.refused("~frame_id", "slash", frame_id="/world")
        self.refused("is a directory", record_bag=self.folder)
        self.refused("~guide_dealy", "no such parameter", "rosparam delete", guide_dealy=0.1)
        self.refused("~set", "rosparam set", set="[time.step=0.002, rods.0.damping.mass=1]")
        self.refused("~frame_id", "one word", frame_id="a b")
        self.refused("missing.yaml: no such file in", scene="missing.yaml")
        self.refused("~guide_delay", guide_delay="soon")
        self.refused("cannot be made a folder", record_bag="/dev/null/at/all.bag")
        self.refused("use_sim_time", pace="follow")
        self.refused("use_sim_time", pace="fast", publish_clock=True)

    def test_unknown_arguments_exit_2(self):
        for program in ("rod_node", "fairing_node", "motion_player"):
            process = self.launch(program, program, {}, ["rope.yaml"])
            self.assertEqual(process.wait(60), 2)
            self.assertIn('unknown argument "rope.yaml"', self.output(program + ".err"))

    def test_numbers_as_strings(self):
        self.start(guide_delay="1e-2")   # what rosparam makes of a number without a point

    def test_scene_of_one_line(self):
        node = self.start(scene="{name: short, rods: [{name: rope}]}")
        self.assertEqual(self.step(1).step, 1)
        node.terminate()   # the next one has the same name and writes into the same files
        node.wait(60)
        self.refused("~scene:1: rods.0.radios", scene="rods: [{radios: 1}]")

    def test_follow_without_a_clock_says_so(self):
        rospy.set_param("/use_sim_time", True)
        try:
            self.start(wait=False, pace="follow")
            wait_until(lambda: "waits for /clock" in self.output("rod.err"), what="a warning")
        finally:
            rospy.delete_param("/use_sim_time")

    def test_follows_the_clock(self):
        rospy.set_param("/use_sim_time", True)
        try:
            self.refused("use_sim_time", pace="wall")
            self.start(wait=False, pace="follow")
            clock = self.publisher("/clock", Clock)
            clock.publish(Clock(rospy.Time.from_sec(5.0)))
            state = self.listen("/t/state", RodState)
            clock.publish(Clock(rospy.Time.from_sec(5.0)))
            rospy.sleep(0.3)
            clock.publish(Clock(rospy.Time(5, 100000000)))
            wait_until(lambda: state.last().step == 20, what="20 steps")
            rospy.sleep(0.3)
            self.assertEqual(state.last().step, 20)
            self.assertEqual(state.last().header.stamp, rospy.Time(5, 100000000))
            self.assertEqual(self.diagnostics("simulation")["message"], "running")
            clock.publish(Clock(rospy.Time(2)))   # a bag that begins anew
            wait_until(lambda: "waits for /clock" in self.diagnostics("simulation")["message"], what="a warning")
            wait_until(lambda: "behind the simulated time" in self.output("rod.err"), what="the same in the log")
        finally:
            rospy.delete_param("/use_sim_time")

    def test_publishes_the_clock(self):
        rospy.set_param("/use_sim_time", True)
        try:
            self.start(publish_clock=True)
            clock = self.listen("/clock", Clock)
            self.step(3)
            wait_until(lambda: clock.last().clock.to_nsec() == 1015000000, what="the clock")
        finally:
            rospy.delete_param("/use_sim_time")


if __name__ == "__main__":
    run("services_test", Services)
