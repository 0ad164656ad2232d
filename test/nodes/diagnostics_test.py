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

        def gathered_as(kind, what):
            return [n for n in levels() if n.startswith(kind) and n.endswith(what)]

        wait_until(lambda: gathered_as("/Simulations/", ": simulation") and gathered_as("/Inputs/", ": inputs"), what="the simulation")
        names = levels()
        own = gathered_as("/Simulations/", ": simulation")[0]
        self.assertLess(names[own], DiagnosticStatus.ERROR)
        node.terminate()
        node.wait(60)
        wait_until(lambda: levels()[own] == DiagnosticStatus.STALE, what="what a node that has gone said last to become stale")


if __name__ == "__main__":
    run("diagnostics", Diagnostics)
