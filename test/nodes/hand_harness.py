"""Drags the handles of ~interactive as rviz does: what the tests of several nodes share."""
import math

from visualization_msgs.msg import InteractiveMarkerFeedback, InteractiveMarkerInit

from node_harness import NodeCase, fill, wait_until


def dragged(name, p, q=(0, 0, 0, 1), frame="world", event=InteractiveMarkerFeedback.POSE_UPDATE):
    message = InteractiveMarkerFeedback()
    message.header.frame_id = frame
    message.client_id = "test"
    message.marker_name = name
    message.event_type = event
    fill(message.pose, p, q)
    return message


class HandCase(NodeCase):

    def begin(self, scene, kind, **parameters):
        self.start(scene, interactive=True, **parameters)
        self.states = self.listen("/t/state", kind)
        self.shown = self.listen("/t/interactive/update_full", InteractiveMarkerInit)
        self.hand = self.publisher("/t/interactive/feedback", InteractiveMarkerFeedback)

    def drag(self, *arguments, **keywords):
        self.hand.publish(dragged(*arguments, **keywords))
        self.arrived()

    def drag_by(self, name, dx, dy, dz, **keywords):
        """From where the handle is, without turning it. Waits until the handle is shown where the hand is, of which the
        server of the handles hears by itself."""
        place, q = self.beside(name, dx, dy, dz)
        self.drag(name, place, q, **keywords)

        def shown():
            p = self.handles()[name].pose.position
            return math.dist((p.x, p.y, p.z), place) < 1e-9
        wait_until(shown, what="the handle where the hand is")

    def beside(self, name, dx, dy, dz):
        wait_until(lambda: self.shown.count() and name in self.handles(), what="the handle " + name)
        at = self.handles()[name].pose
        q = at.orientation
        return (at.position.x + dx, at.position.y + dy, at.position.z + dz), (q.x, q.y, q.z, q.w)

    def after(self, n):
        """Steps one by one: what the hand does is looked at before each call."""
        for _ in range(n - 1):
            self.step(1)
        return self.states_after(self.states, 1)

    def handles(self):
        return {marker.name: marker for marker in self.shown.last().markers}
