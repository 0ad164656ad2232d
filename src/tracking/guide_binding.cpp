#include "slender_sim/tracking/guide_binding.h"

#include <cmath>
#include <stdexcept>

namespace slender {

GuideBinding::GuideBinding(const Eigen::Matrix3Xd& rest, const std::vector<Pose>& rest_poses,
                           const std::vector<Share>& shares)
  : count_(rest.cols()),
    rest_poses_(rest_poses)
{
  Eigen::VectorXd sums = Eigen::VectorXd::Zero(count_);
  for (const Share& s : shares)
  {
    if (s.vertex < 0 || s.vertex >= count_ || s.body < 0 || s.body >= bodies())
      throw std::invalid_argument("guide: vertex " + std::to_string(s.vertex) + " or body " + std::to_string(s.body) +
                                  " is not there (" + std::to_string(count_) + " vertices, " +
                                  std::to_string(bodies()) + " bodies)");
    if (!(s.weight > 0) || !std::isfinite(s.weight))
      throw std::invalid_argument("guide: the share of body " + std::to_string(s.body) + " in vertex " +
                                  std::to_string(s.vertex) + " must be positive");
    sums[s.vertex] += s.weight;
  }
  for (Eigen::Index v = 0; v < count_; ++v)
    if (!(sums[v] > 0))
      throw std::invalid_argument("guide: vertex " + std::to_string(v) + " is carried by no body: add it to a group");
  for (const Share& s : shares)
    carried_.push_back({s.vertex, s.body, s.weight / sums[s.vertex],
                        rest_poses[s.body].inverse() * Eigen::Vector3d(rest.col(s.vertex))});
}

void GuideBinding::place(const std::vector<Pose>& poses, Eigen::Matrix3Xd& vertices) const
{
  vertices.setZero(3, count_);
  for (const Carried& c : carried_)
    vertices.col(c.vertex) += c.weight * (poses[c.body] * c.in_body);
}

void GuideBinding::velocities(const std::vector<Pose>& poses, const std::vector<Twist>& twists,
                              Eigen::Matrix3Xd& out) const
{
  out.setZero(3, count_);
  for (const Carried& c : carried_)
    out.col(c.vertex) +=
        c.weight * (twists[c.body].linear + twists[c.body].angular.cross(poses[c.body].orientation * c.in_body));
}

}   // namespace slender
