"""Starts rod_node by itself with any parameters, and listens to it: what the node tests share."""
import os
import shutil
import subprocess
import tempfile
import threading
import time
import unittest
import xmlrpc.client

import rosgraph
import rospy
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped
from slender_sim.srv import FilePath, Step

SCENE = """
name: test_rope
gravity: [0, 0, -9.81]
time: {step: 0.005, duration: 1, integrator: implicit_euler}
rods:
  - name: rope
    centerline: {straight: {from: [0, 0, 1], to: [1, 0, 1], edges: 20}}
    cross_section: {radius: 0.004}
    material: {density: 1100, youngs_modulus: 1.0e6, poissons_ratio: 0.45}
    damping: {mass: 2.0}
    grasps:
      left: {edges: [0], motion: fixed}
      right: {edges: [-1], motion: {topic: true}, attach: initial}
"""


def find_program(name):
    """Path of a node of this package, in the devel or install space."""
    for folder in os.environ.get("CMAKE_PREFIX_PATH", "").split(":"):
        path = os.path.join(folder, "lib", "slender_sim", name)
        if os.access(path, os.X_OK):
            return path
    found = subprocess.run(["catkin_find", "--libexec", "slender_sim", name], stdout=subprocess.PIPE, universal_newlines=True)
    if found.stdout.strip():
        return found.stdout.split("\n")[0]
    raise RuntimeError("%s is not built" % name)


def others(topic, part):
    """Nodes, other than this one, that publish (part 0) or hear (part 1) a topic."""
    nodes = dict(rosgraph.Master(rospy.get_name()).getSystemState()[part]).get(topic, [])
    return [node for node in nodes if node != rospy.get_name()]


def address_of(node):
    return rosgraph.Master(rospy.get_name()).lookupNode(node)


def sends(node, topic, receiver):
    """True if a node sends a topic to another node, which gets what is published from now on."""
    links = xmlrpc.client.ServerProxy(address_of(node)).getBusInfo(rospy.get_name())[2]
    return any((link[1], link[2], link[4]) == (receiver, "o", topic) for link in links)


class Listener:
    """Collects every message of a topic. What was sent at the same time on another topic, or as the answer of a
    service, may come sooner or later: take what belongs to an instant with at()."""

    def __init__(self, topic, kind):
        self.messages = []
        self.lock = threading.Lock()
        self.subscriber = rospy.Subscriber(topic, kind, self._take, queue_size=10000)

    def _take(self, message):
        with self.lock:
            self.messages.append(message)

    def count(self):
        with self.lock:
            return len(self.messages)

    def all(self):
        with self.lock:
            return list(self.messages)

    def last(self):
        """The newest message. Waits for the first one."""
        wait_until(self.count, what="a message of " + self.subscriber.name)
        with self.lock:
            return self.messages[-1]

    def all_at(self, stamp, count=1):
        """The messages with this stamp. Waits until there are so many."""
        def found():
            return [message for message in self.all() if message.header.stamp == stamp]
        wait_until(lambda: len(found()) >= count, what="%d messages of %s at %s" % (count, self.subscriber.name, stamp))
        return found()

    def at(self, stamp):
        """The message with this stamp. Waits for it."""
        return self.all_at(stamp)[0]

    def connected(self):
        """True if somebody publishes the topic, and if what all its publishers send from now on comes here. Both ends
        must know of a connection: rospy counts those that nobody has answered yet, a node those that have just ended.
        """
        topic = self.subscriber.resolved_name
        answered = [connection.endpoint_id for connection in self.subscriber.impl.connections if connection.header]
        try:
            nodes = others(topic, 0)
            return bool(nodes) and all(address_of(node) in answered and sends(node, topic, rospy.get_name())
                                       for node in nodes)
        except (OSError, rosgraph.MasterException, xmlrpc.client.Error):
            return False   # a publisher has just gone


class Publisher(rospy.Publisher):
    """Counts what it has sent."""

    def __init__(self, topic, kind):
        rospy.Publisher.__init__(self, topic, kind, queue_size=1000)
        self.sent = 0

    def publish(self, *arguments, **keywords):
        rospy.Publisher.publish(self, *arguments, **keywords)
        self.sent += 1

    def connected(self):
        """True if somebody hears the topic, and if everybody who does gets what is sent from now on."""
        nodes = set(others(self.resolved_name, 1))
        return bool(nodes) and nodes <= {connection.endpoint_id for connection in self.impl.connections}


def wait_until(condition, timeout=60.0, what="condition"):
    """The time runs out on failures only: a busy machine may take its time."""
    end = time.time() + timeout
    while time.time() < end:
        if condition():
            return
        time.sleep(0.01)
    raise AssertionError("timed out waiting for " + what)


def status_of(report, kind):
    """Values of the node's status `simulation` or `inputs` in a message of /diagnostics, with `level` and `message`."""
    for status in report.status:
        if status.name == "/t/rod: " + kind:
            values = {value.key: value.value for value in status.values}
            values.update(level=status.level, message=status.message)
            return values
    raise AssertionError("no status " + kind)


class NodeCase(unittest.TestCase):
    """Each test starts its own rod_node in the namespace /t and stops it at the end."""

    def setUp(self):
        self.folder = tempfile.mkdtemp(prefix="slender_sim_test_")
        self.processes = []
        self.ends = []   # subscribers and publishers

    def tearDown(self):
        # rospy has one subscription per topic and process, which keeps its first type: the next test may want another
        for end in self.ends:
            end.unregister()
        for process in self.processes:
            if process.poll() is None:
                process.terminate()
        for process in self.processes:
            try:
                process.wait(10)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
        if rospy.has_param("/t"):
            rospy.delete_param("/t")
        shutil.rmtree(self.folder, ignore_errors=True)

    def path(self, name):
        return os.path.join(self.folder, name)

    def launch(self, program, name, parameters, remappings=()):
        """Starts a program as /t/NAME with private parameters."""
        for key, value in parameters.items():
            rospy.set_param("/t/%s/%s" % (name, key), value)
        process = subprocess.Popen([find_program(program), "__name:=" + name, "__ns:=/t"] + list(remappings),
                                   stdout=open(self.path(name + ".out"), "w"), stderr=open(self.path(name + ".err"), "w"))
        self.processes.append(process)
        return process

    def start(self, scene=SCENE, wait=True, program="rod_node", **parameters):
        """Starts rod_node (or another simulating node); by default it steps only on request, with exact stamps from 1 s on."""
        values = {"scene": scene, "pace": "step", "diagnostics_rate": 20.0, "guide_delay": 0.0, "max_lag": 0.0}   # busy machines are slow
        values.update(parameters)
        process = self.launch(program, "rod", values)
        if wait:
            def up():
                self.assertIsNone(process.poll(), self.output("rod.err"))
                try:
                    rospy.wait_for_service("/t/rod/save_state", 1)
                    # It is refused without a path. Only a node that has published its first state and offers all its
                    # services answers.
                    self.call("save_state", FilePath, "")
                except (rospy.ROSException, rospy.ServiceException):
                    return False
                return True
            wait_until(up, what="the node's services")
        return process

    def output(self, name):
        with open(self.path(name)) as file:
            return file.read()

    def listen(self, topic, kind):
        """Subscribes and waits for the connection: what is published after this call is heard."""
        listener = Listener(topic, kind)
        self.ends.append(listener.subscriber)
        wait_until(listener.connected, what="a publisher of " + topic)
        return listener

    def publisher(self, topic, kind):
        publisher = Publisher(topic, kind)
        self.ends.append(publisher)
        wait_until(publisher.connected, what="a subscriber of " + topic)
        return publisher

    def arrived(self, reports=None):
        """Waits until the node has received all that was sent to it in its namespace. With `reports`, which listens to
        /diagnostics, that is quicker."""
        sent = sum(end.sent for end in self.ends if isinstance(end, Publisher) and end.resolved_name.startswith("/t/"))

        def received():
            return int((status_of(reports.last(), "inputs") if reports else self.diagnostics("inputs"))["received"])
        wait_until(lambda: received() >= sent, what="%d messages to arrive" % sent)

    def call(self, name, kind, *arguments):
        proxy = rospy.ServiceProxy("/t/rod/" + name, kind)
        return proxy(*arguments)

    def step(self, n):
        answer = self.call("step", Step, n)
        self.assertTrue(answer.success, answer.message)
        return answer

    def states_after(self, listener, n):
        """Steps n times and returns the last state: of several objects, that of the first one."""
        return listener.at(self.step(n).stamp)

    def diagnostics(self, kind):
        """Values of the next status `simulation` or `inputs` that the node sends after this call. It connects anew and
        misses reports meanwhile: what is counted since the last report needs a listener. While one listens to
        /diagnostics, the status may be older than the call."""
        return status_of(rospy.wait_for_message("/diagnostics", DiagnosticArray, 60), kind)

    def dropped(self, reason):
        return int(self.diagnostics("inputs")["dropped " + reason])

    def expect_drop(self, reason, count=1):
        wait_until(lambda: self.dropped(reason) == count, what="%d dropped as %s" % (count, reason))


def pose(x, y, z, stamp=0.0, frame="world", q=(0, 0, 0, 1)):
    message = PoseStamped()
    message.header.stamp = rospy.Time.from_sec(stamp)
    message.header.frame_id = frame
    fill(message.pose, (x, y, z), q)
    return message


def fill(out, p, q=(0, 0, 0, 1)):
    out.position.x, out.position.y, out.position.z = p
    out.orientation.x, out.orientation.y, out.orientation.z, out.orientation.w = q
    return out


def numbers(state):
    """All numbers of a state message, for exact comparison."""
    out = []
    for p in state.nodes:
        out += [p.x, p.y, p.z]
    for v in state.velocities:
        out += [v.x, v.y, v.z]
    for q in state.frames:
        out += [q.x, q.y, q.z, q.w]
    return out + list(state.twists)


def run(name, case):
    """Entry of a rostest: runs one TestCase."""
    import rostest
    rospy.init_node(name)
    rostest.rosrun("slender_sim", name, case)
