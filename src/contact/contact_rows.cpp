#include "contact_rows.h"

#include <algorithm>

namespace slender {

void ContactRows::clear(int points)
{
  rows.clear();
  moved_.assign(points, 0);
  clock_ = 0;
}

void ContactRows::restart()
{
  std::fill(moved_.begin(), moved_.end(), 0);
  clock_ = 0;
  for (ContactRow& r : rows)
  {
    r.impulse = 0.0;
    r.rubbing.setZero();
    r.seen = -1;
  }
}

void ContactRows::relax(const Eigen::VectorXd& inverse_mass, int sweeps, Eigen::Matrix3Xd& y)
{
  const auto relative = [&](const ContactRow& r) -> Eigen::Vector3d {
    return r.weight[0] * y.col(r.point[0]) + r.weight[1] * y.col(r.point[1]) + r.weight[2] * y.col(r.point[2]) + r.weight[3] * y.col(r.point[3]);
  };
  double largest = 0.0;
  for (ContactRow& r : rows)
  {
    r.mobility = 0.0;
    for (int i = 0; i < 4; ++i)
      r.mobility += r.weight[i] * r.weight[i] * inverse_mass[r.point[i]];
    if (r.mobility > 0.0)
      largest = std::max(largest, r.bound - r.normal.dot(relative(r)));
  }
  for (int sweep = 0; sweep < sweeps; ++sweep)
  {
    bool settled = true;
    for (ContactRow& r : rows)
    {
      const int moved = std::max(std::max(moved_[r.point[0]], moved_[r.point[1]]), std::max(moved_[r.point[2]], moved_[r.point[3]]));
      if (moved <= r.seen || r.mobility <= 0.0)
        continue;
      const Eigen::Vector3d u = relative(r);
      const double impulse = std::max(0.0, r.impulse + (r.bound - r.normal.dot(u)) / r.mobility);
      Eigen::Vector3d change = (impulse - r.impulse) * r.normal;
      r.impulse = impulse;
      if (r.friction > 0.0)
      {
        const Eigen::Vector3d away = u - r.anchor;
        Eigen::Vector3d rubbing = r.rubbing - (away - away.dot(r.normal) * r.normal) / r.mobility;
        const double most = r.friction * std::max(0.0, impulse - r.push / r.mobility), size = rubbing.norm();
        if (size > most)
          rubbing *= most / size;
        change += rubbing - r.rubbing;
        r.rubbing = rubbing;
      }
      const bool matters = change.norm() * r.mobility > std::max(1e-5 * r.tolerance, std::min(r.tolerance, 1e-3 * largest));
      clock_ += matters;
      for (int i = 0; i < 4; ++i)
      {
        y.col(r.point[i]) += inverse_mass[r.point[i]] * r.weight[i] * change;
        if (matters && r.weight[i] != 0.0)
          moved_[r.point[i]] = clock_;
      }
      r.seen = clock_;
      settled = settled && !matters;
    }
    if (settled)
      return;
  }
}

}  // namespace slender
