#include "slender_sim/energy/membrane_term.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <Eigen/Geometry>
#include <Eigen/LU>

#include "slender_sim/energy/hinge_kernel.h"

namespace slender {

namespace {

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

const MembraneModuli& checked(const MembraneModuli& m)
{
  for (const double modulus : {m.c11, m.c12, m.c22, m.c33})
    if (!std::isfinite(modulus))
      throw std::invalid_argument("membrane: moduli [N/m] must be finite, got " + std::to_string(modulus));
  if (!(m.c11 >= 0 && m.c22 >= 0 && m.c33 >= 0 && m.c12 * m.c12 <= m.c11 * m.c22))
    throw std::invalid_argument("membrane: moduli c11, c22, c33 must be zero or more, and c12^2 at most c11 c22, got " +
                                std::to_string(m.c11) + ", " + std::to_string(m.c22) + ", " + std::to_string(m.c33) +
                                " and c12 = " + std::to_string(m.c12));
  return m;
}

TermSums sumsOf(const MembraneSums& sums) { return {sums.energy, std::max(sums.max_strain, -sums.min_strain)}; }

}   // namespace

MembraneTerm::MembraneTerm(const TriangleMesh& rest, const MembraneModuli& moduli, const Eigen::Vector3d& warp)
  : triangles_(rest.triangles),
    moduli_(checked(moduli))
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

MembraneArrays MembraneTerm::arrays() const
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

void MembraneTerm::setPattern(const BlockMatrix& matrix)
{
  Eigen::Matrix3Xi padded(3, paddedCount());
  for (Eigen::Index f = 0; f < padded.cols(); ++f)
    padded.col(f) = triangles_.col(std::min(f, triangles_.cols() - 1));
  slots_ = matrix.slots(padded);
}

TermSums MembraneTerm::value(const double* x)
{
  MembraneSums sums;
  membraneKernels().energy(arrays(), x, sums);
  return sumsOf(sums);
}

TermSums MembraneTerm::addGradient(const double* x, double* gradient)
{
  MembraneSums sums;
  membraneKernels().gradient(arrays(), x, gradient, sums);
  return sumsOf(sums);
}

TermSums MembraneTerm::addHessian(HessianKind kind, const double* x, double* gradient, double* values,
                                  const double* from)
{
  MembraneSums sums;
  const auto& k = membraneKernels();
  const auto add = kind == HessianKind::exact ? k.hessian : k.semidefiniteHessian;
  add(arrays(), x, from, slots_.data(), gradient, values, sums);
  return sumsOf(sums);
}

void MembraneTerm::addStrains(const PointVector& x, double part)
{
  double* others[3];
  for (int k = 0; k < 3; ++k)
  {
    other_strains_[k].resize(strains_[k].size());
    others[k] = other_strains_[k].data();
  }
  strains(x.data(), others);
  for (int k = 0; k < 3; ++k)
    for (std::size_t f = 0; f < strains_[k].size(); ++f)
      strains_[k][f] += part * other_strains_[k][f];
}

void MembraneTerm::takeStrains(const StrainReference& at)
{
  double* out[3];
  for (int k = 0; k < 3; ++k)
  {
    strains_[k].resize(area_.size());
    out[k] = strains_[k].data();
  }
  strains(at.x->data(), out);
  if (at.share != 0.0)
  {
    for (auto& array : strains_)
      for (double& value : array)
        value *= 1.0 - at.share;
    addStrains(*at.other, at.share);
  }
  if (at.move)
  {
    addStrains(*at.ahead, 0.5);
    addStrains(*at.behind, -0.5);
  }
}

/// The elastic response and a viscous one of stress ratio C (G - viscous strains) are together that of moduli (1 +
/// ratio) C about the weighted mean of both strains.
void MembraneTerm::setResponse(double ratio)
{
  scale_ = 1.0 + ratio;
  for (int k = 0; k < 3 && scale_ != 1.0; ++k)
  {
    rest_strain_[k].resize(area_.size());
    for (std::size_t f = 0; f < area_.size(); ++f)
      rest_strain_[k][f] = ratio / scale_ * strains_[k][f];
  }
}

}   // namespace slender
