#include "collision_rows.h"
#include "slender_sim/linalg/interruption.h"

#include <algorithm>
#include <cmath>

namespace slender {

namespace {

constexpr double kAccuracy = 5e-3;        // of the largest miss
constexpr double kOverRelaxation = 1.3;   // three sheets in a heap: 10 instead of 23 sweeps at the same accuracy

}   // namespace

bool CollisionRows::touch(int first, int count) const
{
  return std::any_of(rows.begin(), rows.end(), [&](const CollisionRow& row) {
    return std::any_of(row.point, row.point + 4, [&](int p) { return p >= first && p < first + count; });
  });
}

void CollisionRows::clear(int points)
{
  rows.clear();
  moved_.assign(points, 0);
  clock_ = 0;
}

void CollisionRows::restart(const Eigen::VectorXd& inverse_mass, double share, Eigen::Matrix3Xd& y)
{
  std::fill(moved_.begin(), moved_.end(), 0);
  clock_ = 0;
  for (CollisionRow& r : rows)
  {
    r.seen = -1;
    if (!(r.mobility > 0.0))
      continue;
    r.impulse = share * std::max(0.0, r.impulse - r.push / r.mobility);
    r.push = 0.0;
    r.rubbing *= share;
    const Eigen::Vector3d impulse = r.impulse * r.normal + r.rubbing;
    for (int i = 0; i < 4; ++i)
      y.col(r.point[i]) += inverse_mass[r.point[i]] * r.weight[i] * impulse;
  }
}

void CollisionRows::relax(const Eigen::VectorXd& inverse_mass, int sweeps, Eigen::Matrix3Xd& y, WorkBudget& budget)
{
  double* const values = y.data();
  const auto relative = [values](const CollisionRow& r) -> Eigen::Vector3d {
    const double *a = values + 3 * r.point[0], *b = values + 3 * r.point[1], *c = values + 3 * r.point[2],
                 *d = values + 3 * r.point[3];
    Eigen::Vector3d u;
    for (int k = 0; k < 3; ++k)
      u[k] = r.weight[0] * a[k] + r.weight[1] * b[k] + r.weight[2] * c[k] + r.weight[3] * d[k];
    return u;
  };
  double largest = 0.0;
  for (CollisionRow& r : rows)
  {
    r.mobility = 0.0;
    for (int i = 0; i < 4; ++i)
    {
      r.response[i] = r.weight[i] * inverse_mass[r.point[i]];
      r.mobility += r.weight[i] * r.response[i];
    }
    if (r.mobility > 0.0)
      largest = std::max(largest, r.bound - r.normal.dot(relative(r)));
  }
  const long looked_at = static_cast<long>(rows.size()) / 8;   // work of a sweep that does nothing
  for (int sweep = 0; sweep < sweeps && !budget.spent() && !stepsInterrupted(); ++sweep)
  {
    long work = looked_at;
    const double relaxation = sweep == 0 ? 1.0 : kOverRelaxation;
    bool settled = true;
    for (CollisionRow& r : rows)
    {
      const int moved =
          std::max(std::max(moved_[r.point[0]], moved_[r.point[1]]), std::max(moved_[r.point[2]], moved_[r.point[3]]));
      if (moved <= r.seen || r.mobility <= 0.0)
        continue;
      ++work;
      const Eigen::Vector3d u = relative(r);
      const double stiffness = 1.0 / r.mobility, missed = r.bound - r.normal.dot(u);
      const double impulse = std::max(0.0, r.impulse + relaxation * missed * stiffness);
      if (impulse == 0.0 && r.impulse == 0.0)   // apart, and was before
      {
        r.seen = clock_;
        continue;
      }
      Eigen::Vector3d change = (impulse - r.impulse) * r.normal;
      r.impulse = impulse;
      if (r.friction > 0.0)
      {
        const Eigen::Vector3d away = u - r.anchor;
        Eigen::Vector3d rubbing = r.rubbing - stiffness * (away - away.dot(r.normal) * r.normal);
        const double most = r.friction * std::max(0.0, impulse - r.push * stiffness), size2 = rubbing.squaredNorm();
        if (size2 > most * most)
          rubbing *= most / std::sqrt(size2);
        change += rubbing - r.rubbing;
        r.rubbing = rubbing;
      }
      const double matter = std::max(1e-5 * r.tolerance, std::min(r.tolerance, kAccuracy * largest)) * stiffness;
      const bool matters = change.squaredNorm() > matter * matter;
      clock_ += matters;
      for (int i = 0; i < 4; ++i)
      {
        double* const at = values + 3 * r.point[i];
        for (int k = 0; k < 3; ++k)
          at[k] += r.response[i] * change[k];
        if (matters && r.response[i] != 0.0)
          moved_[r.point[i]] = clock_;
      }
      r.seen = matters && relaxation != 1.0 ? clock_ - 1 : clock_;   // what goes too far comes back
      settled = settled && !matters;
    }
    budget.spend(work);
    if (settled)
      return;
  }
}

}   // namespace slender
