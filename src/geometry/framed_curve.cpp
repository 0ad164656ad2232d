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
  t_.resize(3, closed ? x.cols() : x.cols() - 1);
  u_.resize(3, edges());
  theta = Eigen::VectorXd::Zero(edges());
  for (int j = 0; j < edges(); ++j)
    t_.col(j) = tangentOf(x, j);
  const auto carried = [&](int to) -> Eigen::Vector3d {
    return parallelTransport(u_.col(before(to)), t_.col(before(to)), t_.col(to));
  };
  u_.col(0) = first;
  for (int j = 1; j < edges(); ++j)
  {
    const Eigen::Vector3d p = carried(j);
    u_.col(j) = (p - p.dot(t_.col(j)) * t_.col(j)).normalized();
  }
  if (closed)
    holonomy_ = signedAngle(carried(0), u_.col(0), t_.col(0));
}

double FramedCurve::twist(int joint) const
{
  return hasJoint(joint) ? theta[joint] - theta[before(joint)] + (joint == 0 ? holonomy_ : 0.0) : 0.0;
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
