// A rod in the search for equilibria, see Statics.
#include <algorithm>
#include <cmath>

#include "rod_part.h"
#include "slender_sim/geometry/rotation.h"

namespace slender {

void RodPart::loadPresent()
{
  rod_.system.leaveOutStretching(false);
  rod_.system.load(rod_.work);
  rod_.system.setResponse(0.0, nullptr);
}

void RodPart::takeTrial()
{
  twist_work_ += rod_.system.twistWork();
  rod_.next = rod_.work;
  rod_.system.store(rod_.next);
  for (std::size_t k = 0; k < rod_.next.grasps.size(); ++k)
    if (rod_.next.grasps[k].active)
      rod_.next.grasps[k].X_WG = rod_.stage_poses[k];   // frames and twists belong to these
  std::swap(rod_.work, rod_.next);
}

std::function<void()> RodPart::wayBack()
{
  return [this, state = rod_.work, work = twist_work_] {
    rod_.work = state;
    twist_work_ = work;
  };
}

double RodPart::shift() const
{
  return (rod_.next.x - rod_.work.x).colwise().norm().maxCoeff() / rod_.model->rest_length.sum();
}

/// Each move of a grasp is at most 2 % of the length and 0.2 rad.
double RodPart::moves() const
{
  double result = 0.0;
  const double length = rod_.model->rest_length.sum();
  for (std::size_t k = 0; k < rod_.work.grasps.size(); ++k)
    if (rod_.work.grasps[k].active)
    {
      const Pose &a = rod_.work.grasps[k].X_WG, &b = rod_.inputs->grasps[k].X_WG;
      const double turn = rotationVector(a.orientation.conjugate() * b.orientation).norm();
      result = std::max({result, (b.position - a.position).norm() / (0.02 * length), turn / 0.2});
    }
  return result;
}

/// A proximal weight of 1 per node [N/m]: 100 times the stiffness of the whole rod against bending, or against its
/// loads if that is larger, shared among its nodes.
double RodPart::proximalUnit() const
{
  const RodModel& m = *rod_.model;
  const double length = m.rest_length.sum(),
               bend = std::max(m.bend_modulus.row(0).maxCoeff(), m.bend_modulus.row(2).maxCoeff());
  double loads = 0.0;
  for (int i = 0; i < m.nodes(); ++i)
    loads += rod_.load(i).norm();
  return std::max(bend / std::pow(length, 3), loads / length) * 100.0 / m.nodes();
}

double RodPart::weightOf(double rate) const { return rate * rod_.model->mass.maxCoeff() / proximalUnit(); }

/// Moves free nodes, and the positions to which the proximal term holds them, along with the grasps: by the
/// displacements of the held nodes before and after them. Otherwise a move longer than an edge would fold the rod next
/// to the grasp.
void RodPart::setProximal(double weight)
{
  const int n = system_.nodes();
  const bool closed = rod_.model->closed;
  const double stiffness = weight * proximalUnit();
  const auto moved = [&](int i) { return Eigen::Vector3d(system_.position(i % n) - rod_.work.x.col(i % n)); };
  const auto place = [&](int i, const Eigen::Vector3d& by) {
    const Eigen::Vector3d x = rod_.work.x.col(i % n) + by;
    system_.setPosition(i % n, x);
    system_.setInertia(i % n, stiffness, x, rod_.load(i % n));
  };
  int first = 0;
  while (first < n && system_.isFree(first))
    ++first;
  if (first == n)
  {
    for (int i = 0; i < n; ++i)
      place(i, Eigen::Vector3d::Zero());
    return;
  }
  if (!closed)
    for (int i = 0; i < first; ++i)
      place(i, moved(first));
  const int end = closed ? first + n : n;   // a loop ends at its first held node again
  for (int left = first; left < end;)
  {
    system_.setInertia(left % n, 0.0, Eigen::Vector3d::Zero(), rod_.load(left % n));
    int right = left + 1;
    while (right < end && system_.isFree(right % n))
      ++right;
    const Eigen::Vector3d a = moved(left), b = right < end || closed ? moved(right) : a;
    for (int i = left + 1; i < right; ++i)
      place(i, a + (b - a) * (static_cast<double>(i - left) / (right - left)));
    left = right;
  }
}

/// The inertia about the tangents is small. On fine meshes a share of 1e-8 of the twist stiffness is more than twisting
/// of the whole rod costs, so that rods which may spin freely get only what round-off needs: 1e-12.
void RodPart::setPencil(double rate)
{
  const RodModel& m = *rod_.model;
  for (int i = 0; i < system_.nodes(); ++i)
    system_.setInertia(i, rod_.system.isMoving(i) ? rate * m.mass[i] : 0.0, system_.position(i), rod_.load(i));
  rod_.system.stiffenAngles(1e-12, std::max(0.0, rate) * m.spin_inertia.mean());
}

StaticScales RodPart::scales() const
{
  const RodModel& m = *rod_.model;
  StaticScales result;
  result.mass = m.totalMass();
  result.least_mass = m.mass.minCoeff();
  result.bending =
      std::min({m.bend_modulus.row(0).minCoeff(), m.bend_modulus.row(2).minCoeff(), m.twist_modulus.minCoeff()}) /
      std::pow(m.rest_length.sum(), 3);
  for (int j = 0; j < m.edges(); ++j)   // stretching of one edge
    result.largest =
        std::max(result.largest,
                 4 * m.stretch_modulus[j] / (m.rest_length[j] * std::min(m.mass[j], m.mass[(j + 1) % m.nodes()])));
  result.points = m.nodes();
  return result;
}

void RodPart::weighDirection()
{
  const RodModel& m = *rod_.model;
  const double spin = m.spin_inertia.mean();
  for (std::size_t u = 0; u < dof_.size(); ++u)
    system_.gradient()[u] =
        dof_[u] < 0 ? 0.0 : -(u % 4 < 3 ? m.mass[static_cast<Eigen::Index>(u / 4)] : spin) * system_.direction()[u];
}

double RodPart::largestTurn() const
{
  const RodModel& m = *rod_.model;
  const auto v = columns();
  double turn = v.cwiseAbs().maxCoeff() / m.rest_length.sum();
  for (int j = 0; j < m.edges(); ++j)
    turn = std::max(
        {turn, (v.col((j + 1) % m.nodes()) - v.col(j)).head<3>().norm() / m.rest_length[j], std::abs(v(3, j))});
  return turn;
}

/// Rounding errors are 1e-16 of each entry, and so of stretching sum of E A / l (|v_i| + |v_j|)^2 and of bending sum of
/// B / l^3 (|v_i| + 2 |v_j| + |v_k|)^2, over sum of m |v|^2. Bending counts where edges are shorter than the rod is
/// thick. B is the smaller bending modulus: rounding errors of the larger one stay in its own plane, and a band that is
/// as wide as those would hide that the rod buckles across that plane.
void RodPart::addRounding(double& stiffness, double& inertia) const
{
  constexpr double kStretching = 2.0, kBending = 0.3;   // measured on 1,280 edges: 0.8 and 0.13
  const RodModel& m = *rod_.model;
  const auto v = columns();
  const auto size = [&](int i) { return v.col(i % m.nodes()).head<3>().norm(); };
  for (int j = 0; j < m.edges(); ++j)
    stiffness += kStretching * m.stretch_modulus[j] / m.rest_length[j] * std::pow(size(j) + size(j + 1), 2);
  const double bend = std::min(m.bend_modulus.row(0).maxCoeff(), m.bend_modulus.row(2).maxCoeff());
  for (int i = 0; i + (m.closed ? 0 : 2) < m.nodes(); ++i)
    stiffness += kBending * bend / std::pow(std::min(m.rest_length[i], m.rest_length[(i + 1) % m.edges()]), 3) *
                 std::pow(size(i) + 2 * size(i + 1) + size(i + 2), 2);
  for (int i = 0; i < m.nodes(); ++i)
    inertia += m.mass[i] * v.col(i).head<3>().squaredNorm();
}

}   // namespace slender
