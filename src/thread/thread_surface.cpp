// Surface tension (thesis 5.4.2): from derivatives by edge lengths to those by node positions.
#include "slender_sim/thread/thread_surface.h"

#include <Eigen/Dense>

#include "slender_sim/energy/end_cap.h"
#include "slender_sim/thread/thread_system.h"

namespace slender {

double surfaceArea(const ThreadState& state, SurfaceShape shape)
{
  const auto length = [&](int j) { return state.edge(j).norm(); };
  const auto end = [&](bool held, int j) {
    return (held ? endArea(length(j), state.volume[j]) : freeEndArea(shape, length(j), state.volume[j])).value;
  };
  const int last = state.edges() - 1;
  double area = end(state.ends[0].held, 0) + end(state.ends[1].held, last);
  for (int j = 0; j < last; ++j)
    area += surfaceArea(shape, length(j), state.volume[j], length(j + 1), state.volume[j + 1]).value;
  return area;
}

double ThreadSystem::addSurface(bool with_hessian)
{
  const auto length = [&](int j) { return 1.0 / a_.inverse_length[j]; };
  double area = 0.0;
  const auto add = [&](int joint, const LengthFunction& f) {
    area += f.value;
    addEdgePair(joint, f, with_hessian);
  };
  // An edge without volume is the inside of a holder, or lies on the floor. It has no surface, and what moves ends
  // before it. Only the ends of the system itself are free ends, which have caps. An end that lies on the floor keeps
  // its cap, as lying edges keep their whole surface: the fluid does not wet the floor.
  const auto end = [&](int j, bool free) {
    return free ? freeEndArea(shape_, length(j), volume_[j]) : endArea(length(j), volume_[j]);
  };
  for (int i = 0; i < a_.nodes; ++i)
  {
    const bool before = i > 0 && volume_[i - 1] > 0, after = i < a_.edges && volume_[i] > 0;
    if (before && after)
      add(i, surfaceArea(shape_, length(i - 1), volume_[i - 1], length(i), volume_[i]));
    else if (before)
      add(i, end(i - 1, i == a_.edges));
    else if (after)
    {
      const LengthFunction f = end(i, i == 0);
      add(i, {f.value, 0, f.d1, 0, 0, f.d11});
    }
  }
  return gamma_ * area;
}

/// gamma times a function of the lengths of the edges before and after a joint.
void ThreadSystem::addEdgePair(int i, const LengthFunction& f, bool with_hessian)
{
  const int n = a_.nodes;
  const Eigen::Vector3d s = i > 0 ? get(a_.t, i - 1) : Eigen::Vector3d::Zero(),
                        t = i + 1 < n ? get(a_.t, i) : Eigen::Vector3d::Zero();
  const Eigen::Vector3d g1 = gamma_ * f.d1 * s, g2 = gamma_ * f.d2 * t;
  const auto gradient = [&](int node) { return Eigen::Map<Eigen::Vector3d>(gradient_.data() + 4 * node); };
  gradient(i) += g1 - g2;
  if (i > 0)
    gradient(i - 1) -= g1;
  if (i + 1 < n)
    gradient(i + 1) += g2;
  if (!with_hessian)
    return;

  const auto own = [&](double second, double first, const Eigen::Vector3d& u, double inverse) {
    return Eigen::Matrix3d(
        gamma_ * (second * u * u.transpose() + first * inverse * (Eigen::Matrix3d::Identity() - u * u.transpose())));
  };
  const Eigen::Matrix3d h11 =
      i > 0 ? own(f.d11, f.d1, s, a_.inverse_length[i - 1]) : Eigen::Matrix3d(Eigen::Matrix3d::Zero());
  const Eigen::Matrix3d h22 =
      i + 1 < n ? own(f.d22, f.d2, t, a_.inverse_length[i]) : Eigen::Matrix3d(Eigen::Matrix3d::Zero());
  const Eigen::Matrix3d h12 = gamma_ * f.d12 * s * t.transpose();
  const auto diagonal = [&](int node, const Eigen::Matrix3d& h) {
    for (int c = 0; c < 3; ++c)
      for (int r = c; r < 3; ++r)
        matrix_.panels()[node].diag[c][r] += h(r, c);
  };
  // h: rows at `node`, columns `blocks` further on
  const auto below = [&](int node, int blocks, const Eigen::Matrix3d& h) {
    for (int c = 0; c < 3; ++c)
      for (int r = 0; r < 3; ++r)
        matrix_.panels()[node].below[c][4 * (blocks - 1) + r] += h(c, r);
  };
  diagonal(i, h11 + h22 - h12 - h12.transpose());
  if (i > 0)
  {
    diagonal(i - 1, h11);
    below(i - 1, 1, h12 - h11);
  }
  if (i + 1 < n)
  {
    diagonal(i + 1, h22);
    below(i, 1, h12 - h22);
  }
  if (i > 0 && i + 1 < n)
    below(i - 1, 2, -h12);
}

}   // namespace slender
