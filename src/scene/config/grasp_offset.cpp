#include "slender_sim/scene/config.h"

namespace slender {

std::optional<Pose> offsetInFrame(const GraspConfig& grasp)
{
  if (grasp.offset || grasp.attach == Attach::initial)
    return grasp.offset;
  const auto* tf = std::get_if<TfMotion>(&grasp.motion);
  return tf ? std::optional<Pose>(tf->offset) : std::nullopt;
}

}   // namespace slender
