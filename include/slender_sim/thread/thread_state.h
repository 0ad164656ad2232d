#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "slender_sim/geometry/pose.h"

namespace slender {

/// What an end of a thread is fixed to: a plate, or at the newest end the nozzle that it leaves. The section there is
/// clamped.
struct ThreadEnd
{
  bool held = false;
  /// origin at the end node, x into the thread (for a nozzle: the flow's direction), y along the section's d1
  Pose X_WE;
};

/// Everything that changes while a thread moves. Nodes are ordered from the oldest to the newest; edge j runs from node
/// j to j+1.
struct ThreadState
{
  std::vector<Eigen::Vector3d> x;    ///< node positions [m]
  std::vector<Eigen::Vector3d> v;    ///< node velocities [m/s]
  std::vector<Eigen::Vector3d> d1;   ///< per edge: first material director
  /// per node: integrated material twist [rad], unwrapped; at held ends that against the holder
  std::vector<double> twist;
  std::vector<double> spin;        ///< per edge: angular velocity about its tangent [rad/s]
  std::vector<double> volume;      ///< per edge [m^3]
  std::vector<std::uint64_t> id;   ///< per node, never used again
  std::vector<char> deposited;     ///< per node: lies on the floor and moves with it
  std::array<ThreadEnd, 2> ends;   ///< of the oldest and the newest node
  std::uint64_t next_id = 0;
  std::uint64_t thread_id = 0;
  double fed_volume = 0.0;       ///< [m^3] that came out of the nozzle since the start
  double dropped_volume = 0.0;   ///< [m^3] of edges that were removed because too many lay on the floor
  double left_volume = 0.0;      ///< [m^3] of edges that were removed because they had left the region

  int nodes() const { return static_cast<int>(x.size()); }
  int edges() const { return static_cast<int>(volume.size()); }
  Eigen::Vector3d edge(int j) const { return x[j + 1] - x[j]; }
  double radius(int j) const { return std::sqrt(volume[j] / (M_PI * edge(j).norm())); }
  double totalVolume() const
  {
    double sum = 0.0;
    for (const double v : volume)
      sum += v;
    return sum;
  }
};

}   // namespace slender
