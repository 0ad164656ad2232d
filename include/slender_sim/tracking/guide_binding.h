#pragma once

#include <vector>

#include <Eigen/Core>

#include "slender_sim/geometry/pose.h"

namespace slender {

/// Guide vertices carried by rigid bodies, several of which may share a vertex (linear blend skinning): vertex = sum_b
/// w_b X_b X_b0^-1 rest.
class GuideBinding
{
public:
  /// Share of a body in a vertex.
  struct Share
  {
    int vertex, body;
    double weight;
  };

  /// rest: guide vertices (3 x n [m]) while the bodies are at `rest_poses`. Shares of a vertex are scaled to sum to 1.
  /// Throws std::invalid_argument naming a vertex without a share, or a share that is not valid.
  GuideBinding(const Eigen::Matrix3Xd& rest, const std::vector<Pose>& rest_poses, const std::vector<Share>& shares);

  int bodies() const { return static_cast<int>(rest_poses_.size()); }
  Eigen::Index vertices() const { return count_; }
  /// The vertices for the bodies' poses.
  void place(const std::vector<Pose>& poses, Eigen::Matrix3Xd& vertices) const;
  /// Their velocities [m/s], for those of the bodies.
  void velocities(const std::vector<Pose>& poses, const std::vector<Twist>& twists, Eigen::Matrix3Xd& out) const;

private:
  struct Carried
  {
    int vertex, body;
    double weight;
    Eigen::Vector3d in_body;
  };
  Eigen::Index count_ = 0;
  std::vector<Pose> rest_poses_;
  std::vector<Carried> carried_;
};

}   // namespace slender
