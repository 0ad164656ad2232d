#pragma once

#include <string>
#include <vector>

#include <interactive_markers/interactive_marker_server.h>

#include "slender_sim/geometry/pose.h"

namespace slender {

/// Something that can be dragged by hand.
struct Handle
{
  std::string name;     ///< of its marker: `grasps/NAME`, `bodies/NAME`, `nozzle`
  Pose X_WH;            ///< where it is
  double size = 0.1;    ///< [m] diameter of its rings
  double ball = 0.03;   ///< [m] diameter of the ball in their middle
  bool turns = true;    ///< false: only its position matters
};

/// Shows handles in rviz (display InteractiveMarkers): arrows and rings of six degrees of freedom, and a ball to move
/// in the view's plane. The server's own thread keeps the handles where the hand leaves them; what the hand does is
/// published on TOPIC/feedback, to which GuideInputs listens.
class HandMarkers
{
public:
  /// `topic`: resolved, e.g. "/interactive".
  HandMarkers(const std::string& topic, const std::string& frame_id);

  /// Puts the handles where their things are; handles of before are gone.
  void show(const std::vector<Handle>& handles);

private:
  std::string frame_id_;
  interactive_markers::InteractiveMarkerServer server_;
};

}   // namespace slender
