#include "slender_sim/energy/membrane_term.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace slender {

namespace {

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
  : energy_(rest, checked(moduli), warp)
{
}

TermSums MembraneTerm::value(const double* x) { return sumsOf(energy_.energy(x)); }

TermSums MembraneTerm::addGradient(const double* x, double* gradient)
{
  return sumsOf(energy_.addGradient(x, gradient));
}

TermSums MembraneTerm::addHessian(HessianKind kind, const double* x, double* gradient, double* values,
                                  const double* from)
{
  return sumsOf(energy_.addHessian(kind, x, slots_, gradient, values, from));
}

void MembraneTerm::addStrains(const PointVector& x, double part)
{
  double* others[3];
  for (int k = 0; k < 3; ++k)
  {
    other_strains_[k].resize(strains_[k].size());
    others[k] = other_strains_[k].data();
  }
  energy_.strains(x.data(), others);
  for (int k = 0; k < 3; ++k)
    for (std::size_t f = 0; f < strains_[k].size(); ++f)
      strains_[k][f] += part * other_strains_[k][f];
}

void MembraneTerm::takeStrains(const StrainReference& at)
{
  double* strains[3];
  for (int k = 0; k < 3; ++k)
  {
    strains_[k].resize(static_cast<std::size_t>(energy_.paddedCount()));
    strains[k] = strains_[k].data();
  }
  energy_.strains(at.x->data(), strains);
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

void MembraneTerm::setResponse(double ratio)
{
  const double* strains[3] = {strains_[0].data(), strains_[1].data(), strains_[2].data()};
  energy_.setResponse(ratio, strains);
}

}   // namespace slender
