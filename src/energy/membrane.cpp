#include "slender_sim/energy/membrane.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include <Eigen/Geometry>
#include <Eigen/LU>

namespace slender {

namespace {

void require(bool good, const char* name, double value, const char* range)
{
  if (!good)
    throw std::invalid_argument(std::string("membrane: ") + name + " must be " + range + ", got " +
                                std::to_string(value));
}

bool positive(double v) { return v > 0 && std::isfinite(v); }

/// Rest edges of a face as columns, in axes along the warp and across it.
Eigen::Matrix2d restEdges(const TriangleMesh& rest, Eigen::Index face, const Eigen::Vector3d& warp)
{
  const Eigen::Vector3d origin = rest.vertices.col(rest.triangles(0, face));
  const Eigen::Vector3d e1 = rest.vertices.col(rest.triangles(1, face)) - origin,
                        e2 = rest.vertices.col(rest.triangles(2, face)) - origin;
  const Eigen::Vector3d cross = e1.cross(e2);
  if (!(cross.norm() > 1e-12 * std::max(e1.squaredNorm(), e2.squaredNorm())))
    throw std::invalid_argument("membrane: face " + std::to_string(face) + " (from 0) of the rest mesh has no area");
  const Eigen::Vector3d n = cross.normalized();
  Eigen::Vector3d u = warp - n * n.dot(warp);
  u = u.norm() > 1e-6 * warp.norm() ? u.normalized() : e1.normalized();
  const Eigen::Vector3d v = n.cross(u);
  Eigen::Matrix2d edges;
  edges << u.dot(e1), u.dot(e2), v.dot(e1), v.dot(e2);
  return edges;
}

}   // namespace

MembraneModuli isotropicMembrane(double youngs_modulus, double poissons_ratio, double thickness)
{
  require(positive(youngs_modulus), "Young's modulus [Pa]", youngs_modulus, "positive");
  require(positive(thickness), "thickness [m]", thickness, "positive");
  require(poissons_ratio > -1 && poissons_ratio <= 0.5, "Poisson's ratio", poissons_ratio, "in (-1, 0.5]");
  const double c = youngs_modulus * thickness / (1.0 - poissons_ratio * poissons_ratio);
  return {c, c * poissons_ratio, c, 0.5 * c * (1.0 - poissons_ratio)};
}

MembraneModuli orthotropicMembrane(double warp, double weft, double poissons_ratio, double shear)
{
  require(positive(warp), "modulus along the warp [N/m]", warp, "positive");
  require(positive(weft), "modulus along the weft [N/m]", weft, "positive");
  require(positive(shear), "shear modulus [N/m]", shear, "positive");
  const double other = poissons_ratio * weft / warp, rest = 1.0 - poissons_ratio * other;
  require(rest > 0, "Poisson's ratio", poissons_ratio, "less than the root of warp over weft modulus in magnitude");
  return {warp / rest, poissons_ratio * weft / rest, weft / rest, shear};
}

MembraneEnergy::MembraneEnergy(const TriangleMesh& rest, const MembraneModuli& moduli, const Eigen::Vector3d& warp)
  : triangles_(rest.triangles),
    moduli_(moduli)
{
  const Eigen::Index n = triangles_.cols(), padded = (n + kPack - 1) / kPack * kPack;
  for (Eigen::Index f = 0; f < padded; ++f)
  {
    const Eigen::Index from = std::min(f, n - 1);
    const Eigen::Matrix2d edges = restEdges(rest, from, warp), inverse = edges.inverse();
    for (int k = 0; k < 3; ++k)
      points_[k].push_back(triangles_(k, from));
    for (int k = 0; k < 4; ++k)
      inverse_[k].push_back(inverse(k / 2, k % 2));
    area_.push_back(f < n ? 0.5 * edges.determinant() : 0.0);
  }
}

MembraneArrays MembraneEnergy::arrays() const
{
  MembraneArrays a;
  a.count = paddedCount();
  for (int k = 0; k < 3; ++k)
    a.points[k] = points_[k].data();
  for (int k = 0; k < 4; ++k)
    a.inverse[k] = inverse_[k].data();
  a.area = area_.data();
  for (int k = 0; k < 3 && scale_ != 1.0; ++k)
    a.rest_strain[k] = rest_strain_[k].data();
  a.c11 = scale_ * moduli_.c11;
  a.c12 = scale_ * moduli_.c12;
  a.c22 = scale_ * moduli_.c22;
  a.c33 = scale_ * moduli_.c33;
  return a;
}

void MembraneEnergy::setResponse(double ratio, const double* const* viscous_strains)
{
  scale_ = 1.0 + ratio;
  for (int k = 0; k < 3 && scale_ != 1.0; ++k)
  {
    rest_strain_[k].resize(area_.size());
    for (std::size_t f = 0; f < area_.size(); ++f)
      rest_strain_[k][f] = ratio / scale_ * viscous_strains[k][f];
  }
}

MembraneSums MembraneEnergy::energy(const double* x) const
{
  MembraneSums sums;
  membraneKernels().energy(arrays(), x, sums);
  return sums;
}

MembraneSums MembraneEnergy::addGradient(const double* x, double* gradient) const
{
  MembraneSums sums;
  membraneKernels().gradient(arrays(), x, gradient, sums);
  return sums;
}

MembraneSums MembraneEnergy::addHessian(HessianKind kind, const double* x, const std::vector<int>& slots,
                                        double* gradient, double* values, const double* from) const
{
  MembraneSums sums;
  const auto& k = membraneKernels();
  const auto add = kind == HessianKind::exact ? k.hessian : k.semidefiniteHessian;
  add(arrays(), x, from, slots.data(), gradient, values, sums);
  return sums;
}

std::vector<int> MembraneEnergy::slotsIn(const BlockMatrix& matrix) const
{
  Eigen::Matrix3Xi padded(3, paddedCount());
  for (Eigen::Index f = 0; f < padded.cols(); ++f)
    for (int k = 0; k < 3; ++k)
      padded(k, f) = points_[k][f];
  return matrix.slots(padded);
}

}   // namespace slender
