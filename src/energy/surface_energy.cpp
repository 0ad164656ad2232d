// Surface tension (thesis 5.4.2): from derivatives by edge lengths to those by node positions.
#include "slender_sim/energy/surface_energy.h"

#include <algorithm>

#include <Eigen/Dense>

#include "slender_sim/energy/end_cap.h"

namespace slender {

void SurfaceEnergy::begin(double gamma, SurfaceShape shape, int edges)
{
  gamma_ = gamma;
  shape_ = shape;
  volume_.resize(edges);
  std::fill(volume_.begin(), volume_.end(), 0.0);
}

void SurfaceEnergy::add(const ChainRange& range, RodEvaluation& sum)
{
  const RodArrays& a = range.arrays;
  const auto length = [&](int j) { return 1.0 / a.inverse_length[j]; };
  double area = 0.0;
  const auto add = [&](int joint, const LengthFunction& f) {
    area += f.value;
    addEdgePair(joint, f, range);
  };
  // An edge without volume is the inside of a holder, or lies on the floor. It has no surface, and what moves ends
  // before it. Only the ends of the chain itself are free ends, which have caps. An end that lies on the floor keeps
  // its cap, as lying edges keep their whole surface: the fluid does not wet the floor.
  const auto end = [&](int j, bool free) {
    return free ? freeEndArea(shape_, length(j), volume_[j]) : endArea(length(j), volume_[j]);
  };
  // the newest node of what is around a node is the next one
  const int from = std::max(range.from - 1, 0), to = range.to < a.nodes ? range.to - 1 : a.nodes;
  for (int i = from; i < to; ++i)
  {
    const bool before = i > 0 && volume_[i - 1] > 0, after = i < a.edges && volume_[i] > 0;
    if (before && after)
      add(i, surfaceArea(shape_, length(i - 1), volume_[i - 1], length(i), volume_[i]));
    else if (before)
      add(i, end(i - 1, i == a.edges));
    else if (after)
    {
      const LengthFunction f = end(i, i == 0);
      add(i, {f.value, 0, f.d1, 0, 0, f.d11});
    }
  }
  sum.stretch += gamma_ * area;
}

/// gamma times a function of the lengths of the edges before and after a joint.
void SurfaceEnergy::addEdgePair(int i, const LengthFunction& f, const ChainRange& range) const
{
  const RodArrays& a = range.arrays;
  const int n = a.nodes;
  const auto tangent = [&](int j) { return Eigen::Vector3d(a.t[0][j], a.t[1][j], a.t[2][j]); };
  const Eigen::Vector3d s = i > 0 ? tangent(i - 1) : Eigen::Vector3d::Zero(),
                        t = i + 1 < n ? tangent(i) : Eigen::Vector3d::Zero();
  const Eigen::Vector3d g1 = gamma_ * f.d1 * s, g2 = gamma_ * f.d2 * t;
  const auto gradient = [&](int node) { return Eigen::Map<Eigen::Vector3d>(a.gradient + 4 * node); };
  gradient(i) += g1 - g2;
  if (i > 0)
    gradient(i - 1) -= g1;
  if (i + 1 < n)
    gradient(i + 1) += g2;
  if (!range.panels)
    return;

  const auto own = [&](double second, double first, const Eigen::Vector3d& u, double inverse) {
    return Eigen::Matrix3d(
        gamma_ * (second * u * u.transpose() + first * inverse * (Eigen::Matrix3d::Identity() - u * u.transpose())));
  };
  const Eigen::Matrix3d h11 =
      i > 0 ? own(f.d11, f.d1, s, a.inverse_length[i - 1]) : Eigen::Matrix3d(Eigen::Matrix3d::Zero());
  const Eigen::Matrix3d h22 =
      i + 1 < n ? own(f.d22, f.d2, t, a.inverse_length[i]) : Eigen::Matrix3d(Eigen::Matrix3d::Zero());
  const Eigen::Matrix3d h12 = gamma_ * f.d12 * s * t.transpose();
  const auto diagonal = [&](int node, const Eigen::Matrix3d& h) {
    RodPanel& p = range.panel(node);
    for (int c = 0; c < 3; ++c)
      for (int r = c; r < 3; ++r)
        p.diag[c][r] += h(r, c);
  };
  // h: rows at `node`, columns `blocks` further on
  const auto below = [&](int node, int blocks, const Eigen::Matrix3d& h) {
    RodPanel& p = range.panel(node);
    for (int c = 0; c < 3; ++c)
      for (int r = 0; r < 3; ++r)
        p.below[c][4 * (blocks - 1) + r] += h(c, r);
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
