#include "impact_zones.h"

#include <algorithm>
#include <numeric>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

namespace slender {

void ImpactZones::clear(int points, int bodies)
{
  points_ = points;
  joined_ = 0;
  parent_.resize(points + bodies);
  std::iota(parent_.begin(), parent_.end(), 0);
}

int ImpactZones::root(int i)
{
  while (parent_[i] != i)
    i = parent_[i] = parent_[parent_[i]];
  return i;
}

void ImpactZones::join(int a, int b)
{
  a = root(a);
  b = root(b);
  if (a == b)
    return;
  parent_[std::max(a, b)] = std::min(a, b);   // the lowest member is the root, whatever the order
  ++joined_;
}

const std::vector<ImpactZones::Zone>& ImpactZones::zones(const Eigen::VectorXd& inverse_mass)
{
  const int n = static_cast<int>(parent_.size());
  const auto prescribed = [&](int i) { return i >= points_ || inverse_mass[i] == 0.0; };
  members_.clear();
  order_.clear();
  zones_.clear();
  for (int i = 0; i < n; ++i)
  {
    parent_[i] = root(i);
    if (parent_[i] != i)
      order_.push_back(i);
  }
  // members by zone; the root itself goes first
  std::sort(order_.begin(), order_.end(),
            [&](int a, int b) { return std::make_pair(parent_[a], a) < std::make_pair(parent_[b], b); });
  members_.reserve(2 * order_.size() + 1);   // zones point into it
  for (std::size_t from = 0, to; from < order_.size(); from = to)
  {
    const int first = parent_[order_[from]];
    for (to = from; to < order_.size() && parent_[order_[to]] == first; ++to)
      ;
    Zone zone{};
    for (const bool fixed : {false, true})
    {
      const std::size_t begin = members_.size();
      if (prescribed(first) == fixed)
        members_.push_back(first);
      for (std::size_t k = from; k < to; ++k)
        if (prescribed(order_[k]) == fixed)
          members_.push_back(order_[k]);
      (fixed ? zone.prescribed : zone.members) = members_.data() + begin;
      (fixed ? zone.prescribed_count : zone.count) = static_cast<int>(members_.size() - begin);
    }
    zones_.push_back(zone);
  }
  return zones_;
}

RigidFit rigidFit(const int* points, int count, const Eigen::VectorXd& inverse_mass, const Eigen::Matrix3Xd& x,
                  const Eigen::Matrix3Xd& u)
{
  RigidFit fit{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  double mass = 0.0;
  for (int k = 0; k < count; ++k)
  {
    const double m = 1.0 / inverse_mass[points[k]];
    mass += m;
    fit.center += m * x.col(points[k]);
    fit.linear += m * u.col(points[k]);
  }
  fit.center /= mass;
  fit.linear /= mass;
  Eigen::Vector3d momentum = Eigen::Vector3d::Zero();
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();
  for (int k = 0; k < count; ++k)
  {
    const double m = 1.0 / inverse_mass[points[k]];
    const Eigen::Vector3d r = x.col(points[k]) - fit.center;
    momentum += m * r.cross(Eigen::Vector3d(u.col(points[k]) - fit.linear));
    inertia += m * (r.squaredNorm() * Eigen::Matrix3d::Identity() - r * r.transpose());
  }
  // no rotation about an axis along which all points lie
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver;
  solver.computeDirect(inertia);
  for (int k = 0; k < 3; ++k)
  {
    const double moment = solver.eigenvalues()[k];
    const Eigen::Vector3d axis = solver.eigenvectors().col(k);
    if (moment > 1e-9 * solver.eigenvalues()[2])
      fit.angular += axis.dot(momentum) / moment * axis;
  }
  return fit;
}

}   // namespace slender
