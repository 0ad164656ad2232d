#!/usr/bin/python3
"""launch/diagnostics.launch gathers what the nodes report."""
import rospy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus

from node_harness import NodeCase, run, wait_until


class Diagnostics(NodeCase):

    def test_gathered_by_kind(self):
        gathered = self.listen("/diagnostics_agg", DiagnosticArray)
        node = self.start(pace="wall")

        def levels():
            return {status.name: status.level for status in gathered.last().status} if gathered.count() else {}

        wait_until(lambda: "/Simulations/t_rod: simulation" in levels() or "/Simulations//t/rod: simulation" in levels(), what="the simulation")
        names = levels()
        self.assertTrue([n for n in names if n.startswith("/Inputs/") and n.endswith("rod: inputs")], names)
        own = [n for n in names if n.startswith("/Simulations/") and n.endswith("rod: simulation")][0]
        self.assertLess(names[own], DiagnosticStatus.ERROR)
        node.terminate()
        node.wait(20)
        wait_until(lambda: levels()[own] == DiagnosticStatus.STALE, what="what a node that has gone said last to become stale")


if __name__ == "__main__":
    run("diagnostics", Diagnostics)
