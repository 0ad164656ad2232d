#include "slender_sim/geometry/framed_curve.h"

#include <cmath>
#include <stdexcept>
#include <string>

#include "slender_sim/geometry/rotation.h"

namespace slender {

namespace {
// 1 + t.t' below this: the turn is within about 1e-3 rad of a fold, and 2 tan(phi/2) is meaningless
constexpr double kFolded = 1e-6;

Eigen::Vector3d tangentOf(const Eigen::Matrix3Xd& x, int edge)
{
  const int next = (edge + 1) % static_cast<int>(x.cols());
  const Eigen::Vector3d e = x.col(next) - x.col(edge);
  const double length = e.norm();
  if (!(length > 0) || !std::isfinite(length))
    throw std::invalid_argument("nodes " + std::to_string(edge) + " and " + std::to_string(next) +
                                " coincide or are not finite");
  return e / length;
}
}   // namespace

Eigen::Vector3d firstDirector(const Eigen::Matrix3Xd& x, bool closed, const Eigen::Vector3d& director)
{
  const int n = static_cast<int>(x.cols()), edges = closed ? n : n - 1;
  if (n < 2 || (closed && n < 3))
    throw std::invalid_argument("a curve needs at least " + std::string(closed ? "3" : "2") + " nodes, got " +
                                std::to_string(n));
  if (!director.allFinite())
    throw std::invalid_argument("director is not finite");
  const Eigen::Vector3d t0 = tangentOf(x, 0), u = director - director.dot(t0) * t0;
  if (director.norm() > 0 && u.norm() < 1e-6 * director.norm())
    throw std::invalid_argument("director is parallel to the first edge; give a direction across it");
  for (int j = closed ? 0 : 1; j < edges; ++j)
    if (1.0 + tangentOf(x, (j + edges - 1) % edges).dot(tangentOf(x, j)) < kFolded)
      throw std::invalid_argument("the curve folds back on itself at node " + std::to_string(j));
  return director.norm() > 0 ? Eigen::Vector3d(u.normalized()) : anyNormal(t0);
}

FramedCurve::FramedCurve(const Eigen::Matrix3Xd& x, bool closed, const Eigen::Vector3d& director) : closed_(closed)
{
  const Eigen::Vector3d first = firstDirector(x, closed, director);
  const int n = static_cast<int>(x.cols());
  t_.resize(3, closed ? n : n - 1);
  u_.resize(3, t_.cols());
  theta = Eigen::VectorXd::Zero(t_.cols());
  reference_twist_ = Eigen::VectorXd::Zero(n);
  t_ = tangentsOf(x);
  x_ = x;
  u_.col(0) = first;
  makeSpaceParallel();
}

Eigen::Matrix3Xd FramedCurve::tangentsOf(const Eigen::Matrix3Xd& x) const
{
  Eigen::Matrix3Xd t(3, edges());
  for (int j = 0; j < edges(); ++j)
    t.col(j) = tangentOf(x, j);
  return t;
}

void FramedCurve::moveTo(const Eigen::Matrix3Xd& x)
{
  if (x.cols() != x_.cols())
    throw std::invalid_argument("moveTo: expected " + std::to_string(x_.cols()) + " nodes, got " +
                                std::to_string(x.cols()));
  const Eigen::Matrix3Xd old = t_, moved = tangentsOf(x);
  for (int j = 0; j < edges(); ++j)
    if (1.0 + old.col(j).dot(moved.col(j)) < kFolded)
      throw std::invalid_argument("edge " + std::to_string(j) + " turned over in one move; move in smaller steps");
  t_ = moved;
  x_ = x;
  for (int j = 0; j < edges(); ++j)
  {
    const Eigen::Vector3d u = parallelTransport(u_.col(j), old.col(j), t_.col(j));
    u_.col(j) = (u - u.dot(t_.col(j)) * t_.col(j)).normalized();
  }
  for (int i = 0; i < nodes(); ++i)
    if (hasJoint(i))
    {
      const Eigen::Vector3d p = parallelTransport(u_.col(before(i)), t_.col(before(i)), t_.col(i));
      reference_twist_[i] = unwrapNear(signedAngle(p, u_.col(i), t_.col(i)), reference_twist_[i]);
    }
}

void FramedCurve::makeSpaceParallel()
{
  double turned = 0.0;   // of the old reference frame of an edge against the new one
  for (int i = 1; i < edges(); ++i)
  {
    const Eigen::Vector3d p = parallelTransport(u_.col(i - 1), t_.col(i - 1), t_.col(i));
    turned += reference_twist_[i];
    u_.col(i) = (p - p.dot(t_.col(i)) * t_.col(i)).normalized();
    theta[i] += turned;
    reference_twist_[i] = 0.0;
  }
  if (closed_)
  {
    const Eigen::Vector3d p = parallelTransport(u_.col(edges() - 1), t_.col(edges() - 1), t_.col(0));
    reference_twist_[0] = unwrapNear(signedAngle(p, u_.col(0), t_.col(0)), reference_twist_[0] + turned);
  }
}

double FramedCurve::twist(int joint) const
{
  return hasJoint(joint) ? theta[joint] - theta[before(joint)] + reference_twist_[joint] : 0.0;
}

Eigen::Vector3d FramedCurve::curvatureBinormal(int joint) const
{
  if (!hasJoint(joint))
    return Eigen::Vector3d::Zero();
  const Eigen::Vector3d a = t_.col(before(joint)), b = t_.col(joint);
  return 2.0 * a.cross(b) / (1.0 + a.dot(b));
}

Eigen::Vector2d FramedCurve::materialCurvature(int joint) const
{
  if (!hasJoint(joint))
    return Eigen::Vector2d::Zero();
  const Eigen::Vector3d kb = curvatureBinormal(joint);
  const int e = before(joint);
  return {0.5 * kb.dot(d2(e) + d2(joint)), -0.5 * kb.dot(d1(e) + d1(joint))};
}

Eigen::Vector3d FramedCurve::d1(int edge) const { return rotateAbout(u_.col(edge), t_.col(edge), theta[edge]); }

Eigen::Vector3d FramedCurve::d2(int edge) const { return t_.col(edge).cross(d1(edge)); }

}   // namespace slender
