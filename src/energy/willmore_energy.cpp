#include "slender_sim/energy/willmore_energy.h"

#include <cmath>
#include <limits>
#include <stdexcept>

#include <Eigen/Geometry>

namespace slender {

namespace {

using Eigen::Vector3d;

struct Face
{
  Vector3d edges[3];   ///< opposite to the corners
  Vector3d normal;     ///< of length twice the area

  Face(const double* x, const int* corners)
  {
    const auto p = [&](int k) { return Eigen::Map<const Vector3d>(x + 4 * corners[k]); };
    edges[0] = p(2) - p(1);
    edges[1] = p(0) - p(2);
    edges[2] = p(1) - p(0);
    normal = edges[2].cross(-edges[1]);
  }
};

/// Sine of the smallest angle, about, below which the face counts as one without area: its curvatures would be
/// round-off.
constexpr double kFlat = 1e-9;

}   // namespace

WillmoreEnergy::WillmoreEnergy(const Eigen::Matrix3Xi& faces, std::vector<char> counted)
  : faces_(faces),
    counted_(std::move(counted))
{
  if (faces_.size() > 0 && (faces_.minCoeff() < 0 || faces_.maxCoeff() >= static_cast<int>(counted_.size())))
    throw std::invalid_argument("WillmoreEnergy: a face names a vertex that is not there");
  curvature_.assign(4 * counted_.size(), 0.0);
}

double WillmoreEnergy::energy(const double* x)
{
  std::fill(curvature_.begin(), curvature_.end(), 0.0);
  for (Eigen::Index f = 0; f < faces_.cols(); ++f)
  {
    const int* corners = faces_.data() + 3 * f;
    const Face face(x, corners);
    const double twice = face.normal.norm();
    if (!(twice > kFlat * face.edges[0].squaredNorm()) || !(twice > kFlat * face.edges[1].squaredNorm()))
      return std::numeric_limits<double>::infinity();
    const Vector3d half = face.normal * (-0.5 / twice);
    for (int k = 0; k < 3; ++k)
    {
      point(curvature_, corners[k]) += half.cross(face.edges[k]);
      curvature_[4 * corners[k] + 3] += twice / 6.0;
    }
  }
  double energy = 0.0;
  for (std::size_t i = 0; i < counted_.size(); ++i)
  {
    auto h = point(curvature_, static_cast<Eigen::Index>(i));
    double& area = curvature_[4 * i + 3];
    if (!counted_[i] || area == 0.0)
    {
      h.setZero();
      area = 0.0;
      continue;
    }
    h /= area;
    const double density = 0.5 * h.squaredNorm();
    energy += area * density;
    area = density;
  }
  return std::isfinite(energy) ? energy : std::numeric_limits<double>::infinity();
}

double WillmoreEnergy::addGradient(const double* x, double* gradient)
{
  const double value = energy(x);
  if (!std::isfinite(value))
    return value;
  // dE = sum h_i . dl_i - c_i dA_i with h = l/A, c = |h|^2/2. In a face with edges e_i and the unit normal n, sum h_i .
  // l_i is
  // -(n . w) / 2 with w = sum e_i x h_i.
  for (Eigen::Index f = 0; f < faces_.cols(); ++f)
  {
    const int* corners = faces_.data() + 3 * f;
    const Face face(x, corners);
    Vector3d w = Vector3d::Zero();
    double density = 0.0;
    for (int k = 0; k < 3; ++k)
    {
      w += face.edges[k].cross(point(curvature_, corners[k]));
      density += curvature_[4 * corners[k] + 3];
    }
    const double inverse = 1.0 / face.normal.norm();
    const Vector3d n = face.normal * inverse;
    const Vector3d by_normal = (w - n * n.dot(w)) * (-0.5 * inverse) - n * (density / 6.0);
    Vector3d lever[3];
    for (int k = 0; k < 3; ++k)
      lever[k] = 0.5 * point(curvature_, corners[k]).cross(n);
    for (int k = 0; k < 3; ++k)
      Eigen::Map<Vector3d>(gradient + 4 * corners[k]) +=
          by_normal.cross(face.edges[k]) + lever[(k + 2) % 3] - lever[(k + 1) % 3];
  }
  return value;
}

bool WillmoreEnergy::foldsOver(const double* from, const double* to) const
{
  for (Eigen::Index f = 0; f < faces_.cols(); ++f)
    if (!(Face(from, faces_.data() + 3 * f).normal.dot(Face(to, faces_.data() + 3 * f).normal) > 0.0))
      return true;
  return false;
}

}   // namespace slender
