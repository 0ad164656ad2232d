#include "slender_sim/scene/config.h"

namespace slender {

bool GuideConfig::byTopic() const
{
  const auto* carried = std::get_if<CarriedGuide>(&motion);
  return std::holds_alternative<TopicGuide>(motion) || (carried && carried->poses.empty());
}

void GuideConfig::evaluate(double time, Eigen::Matrix3Xd& vertices, Eigen::Matrix3Xd* velocities) const
{
  if (const auto* frames = std::get_if<FrameGuide>(&motion))
  {
    frames->points.evaluate(time, vertices, velocities);
    return;
  }
  if (const auto* preview = std::get_if<ClothGuide>(&motion))
  {
    vertices = preview->start;
    if (velocities)
      *velocities = preview->velocity;
    return;
  }
  const auto* carried = std::get_if<CarriedGuide>(&motion);
  if (!carried || carried->poses.empty())
  {
    vertices = mesh.vertices;
    if (velocities)
      velocities->setZero(3, vertices.cols());
    return;
  }
  std::vector<Pose> poses;
  std::vector<Twist> twists(carried->poses.size());
  for (std::size_t b = 0; b < carried->poses.size(); ++b)
  {
    const PoseTrajectory& body = carried->poses[b];
    const Pose X = body.evaluate(time, &twists[b]);
    poses.push_back(carried->keeps_offset ? X * body.evaluate(body.firstTime()).inverse() : X);
    // of the point that is at the origin of `poses`
    twists[b].linear += twists[b].angular.cross(poses[b].position - X.position);
  }
  carried->binding.place(poses, vertices);
  if (velocities)
    carried->binding.velocities(poses, twists, *velocities);
}

std::optional<Pose> offsetInFrame(const GraspConfig& grasp)
{
  if (grasp.offset || grasp.attach == Attach::initial)
    return grasp.offset;
  const auto* tf = std::get_if<TfMotion>(&grasp.motion);
  return tf ? std::optional<Pose>(tf->offset) : std::nullopt;
}

}   // namespace slender
