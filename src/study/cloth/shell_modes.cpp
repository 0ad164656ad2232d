// Lowest vibrations of a mesh at rest by inverse iteration, and of the continuous shell by the method of Ritz.
#include "shell_modes.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <Eigen/Eigenvalues>

#include "slender_sim/energy/hinge_term.h"
#include "slender_sim/energy/membrane_term.h"
#include "slender_sim/energy/isometric_bending.h"
#include "slender_sim/linalg/sparse_cholesky.h"

namespace slender::study {

namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Points and weights of Gauss's rule on [-1, 1], from the eigenvalues of Legendre's three-term recursion [Golub and
/// Welsch 1969].
void gaussRule(int count, VectorXd& points, VectorXd& weights)
{
  MatrixXd jacobi = MatrixXd::Zero(count, count);
  for (int k = 1; k < count; ++k)
    jacobi(k, k - 1) = jacobi(k - 1, k) = k / std::sqrt(4.0 * k * k - 1.0);
  const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(jacobi);
  points = solver.eigenvalues();
  weights = 2.0 * solver.eigenvectors().row(0).transpose().array().square();
}

/// Value and first two derivatives of a function of one variable.
using Jet = Eigen::Vector3d;

Jet product(const Jet& a, const Jet& b)
{
  return {a[0] * b[0], a[1] * b[0] + a[0] * b[1], a[2] * b[0] + 2 * a[1] * b[1] + a[0] * b[2]};
}

/// Legendre polynomials 0 .. count - 1 at s.
std::vector<Jet> legendre(int count, double s)
{
  std::vector<Jet> p{Jet(1, 0, 0), Jet(s, 1, 0)};
  const Jet variable(s, 1, 0);
  for (int k = 2; k < count; ++k)
    p.push_back(((2 * k - 1) * product(variable, p[static_cast<std::size_t>(k - 1)]) -
                 (k - 1) * p[static_cast<std::size_t>(k - 2)]) /
                k);
  p.resize(static_cast<std::size_t>(count));
  return p;
}

/// Adds the energy and the inertia at one point of integration. Rows of `strains`: two stretches, shear angle, two
/// curvatures, twice the twist. Rows of `moves`: the displacement.
struct RitzSum
{
  MatrixXd stiffness, mass;
  Eigen::Matrix<double, 6, 6> moduli = Eigen::Matrix<double, 6, 6>::Zero();
  double density = 0.0;

  RitzSum(const ShellMaterial& m, Eigen::Index size)
    : stiffness(MatrixXd::Zero(size, size)),
      mass(MatrixXd::Zero(size, size)),
      density(m.area_density)
  {
    const auto plane = [this](int first, double modulus, double ratio) {
      moduli.block<2, 2>(first, first) << modulus, ratio * modulus, ratio * modulus, modulus;
      moduli(first + 2, first + 2) = 0.5 * (1.0 - ratio) * modulus;
    };
    plane(0, m.stretching, m.membrane_ratio);
    plane(3, m.bending, m.bending_ratio);
  }
  void add(const MatrixXd& strains, const MatrixXd& moves, double area)
  {
    stiffness += area * strains.transpose() * moduli * strains;
    mass += area * density * moves.transpose() * moves;
  }
  VectorXd frequencies() const
  {
    const Eigen::GeneralizedSelfAdjointEigenSolver<MatrixXd> solver(stiffness, mass, Eigen::EigenvaluesOnly);
    return solver.eigenvalues().cwiseMax(0.0).cwiseSqrt();
  }
};

/// One harmonic around the axis of a cap: displacements U cos(m a) along the meridian, V sin(m a) around it and W cos(m
/// a) outwards.
VectorXd capHarmonic(const ShellMaterial& material, double radius, double angle, int m, int terms)
{
  VectorXd points, weights;
  gaussRule(terms + m + 8, points, weights);
  const int families = m == 0 ? 2 : 3;   // without a harmonic nothing turns about the axis
  RitzSum sum(material, families * terms);
  MatrixXd strains(6, families * terms), moves(3, families * terms);
  for (Eigen::Index q = 0; q < points.size(); ++q)
  {
    const double p = 0.5 * angle * (1.0 + points[q]), s = p / angle, sine = std::sin(p), cotangent = std::cos(p) / sine;
    const Jet square(s * s, 2 * s / angle, 2 / (angle * angle)), rim = Jet(1, 0, 0) - square;
    const auto power = [&](int k) -> Jet {
      return {std::pow(s, k), k > 0 ? k * std::pow(s, k - 1) / angle : 0.0,
              k > 1 ? k * (k - 1) * std::pow(s, k - 2) / (angle * angle) : 0.0};
    };
    const std::vector<Jet> along = legendre(terms, 2 * s * s - 1);
    for (int k = 0; k < terms; ++k)
    {
      const Jet& at = along[static_cast<std::size_t>(k)];   // by 2 s^2 - 1, chain rule
      const double inner = 4 * s / angle;
      const Jet base(at[0], at[1] * inner, at[2] * inner * inner + at[1] * 4 / (angle * angle));
      const Jet tangential = product(base, rim), normal = product(product(base, product(rim, rim)), power(m));
      for (int family = 0; family < families; ++family)
      {
        // At the pole the displacement is smooth where U + V goes as s^(m+1), U - V as s^(m-1) and W as s^m.
        const Jet zero = Jet::Zero(), f = family == 0            ? product(tangential, power(m + 1))
                                          : family == 1 && m > 0 ? product(tangential, power(m - 1))
                                                                 : zero;
        const bool outwards = family == families - 1;
        const Jet u = outwards ? zero : f,
                  v = outwards || m == 0 ? zero
                      : family == 0      ? f
                                         : Jet(-f),
                  w = outwards ? normal : zero;
        const Jet turn = u - Jet(w[1], w[2], 0);   // beta_phi times the radius; the last entry is not used
        const Jet across = v + m / sine * w;       // beta_theta times the radius, whose slope follows
        const double across_slope = v[1] + m / sine * (w[1] - cotangent * w[0]);
        const int column = family * terms + k;
        strains.col(column) << (u[1] + w[0]) / radius, (m * v[0] / sine + cotangent * u[0] + w[0]) / radius,
            (v[1] - cotangent * v[0] - m * u[0] / sine) / radius, turn[1] / (radius * radius),
            (m * across[0] / sine + cotangent * turn[0]) / (radius * radius),
            (across_slope - cotangent * across[0] - m * turn[0] / sine) / (radius * radius);
        moves.col(column) << u[0], v[0], w[0];
      }
    }
    sum.add(strains, moves, 0.5 * angle * weights[q] * radius * radius * sine);
  }
  return sum.frequencies();
}

}   // namespace

BlockMatrix elasticHessian(const ClothModel& model, const ClothState& state)
{
  const MeshTopology& t = model.topology;
  MembraneTerm membrane(model.rest, model.membrane, model.warp);
  const double coefficient =
      model.bending_modulus * bendingCalibration(model.rest, t, IsometricElement::nonconforming, model.warp);
  BlockMatrix matrix(model.vertices(), {model.rest.triangles, t.hinges});
  PointVector x, gradient(4 * static_cast<std::size_t>(model.vertices()), 0.0);
  toPoints(state.x, x);
  matrix.setZero();
  membrane.setPattern(matrix);
  membrane.addHessian(HessianKind::exact, x.data(), gradient.data(), matrix.values());
  if (model.bending == BendingModel::hinge)
  {
    HingeTerm hinges(t.hinges, hingeStiffness(model.rest, t, coefficient, model.clamped_faces), state.rest_angles);
    hinges.setPattern(matrix);
    hinges.addHessian(HessianKind::exact, x.data(), gradient.data(), matrix.values());
    return matrix;
  }
  if (model.bending != BendingModel::isometric_nonconforming || model.bending_poissons_ratio)
    throw std::runtime_error("elasticHessian: only hinges and isometric bending without a ratio of its own");
  const PointMatrix bending =
      isometricBending(model.rest, t, IsometricElement::nonconforming, coefficient, model.clamped_faces);
  matrix.add(1.0, bending, matrix.mapOf(bending));
  return matrix;
}

VectorXd meshFrequencies(const ClothModel& model, const std::vector<int>& held, int count)
{
  const int n = model.vertices(), vectors = 2 * count + 4, rounds = 20;
  const BlockMatrix stiffness = elasticHessian(model, makeClothState(model, model.rest.vertices));
  std::vector<char> fixed(static_cast<std::size_t>(n), 0);
  for (const int v : held)
    fixed[static_cast<std::size_t>(v)] = 1;
  SparseCholesky factor;
  factor.setPattern(stiffness);
  if (!factor.factor(stiffness, fixed.data()))
    throw std::runtime_error("meshFrequencies: the stiffness at rest is not positive definite; hold more of the mesh");
  std::vector<PointVector> basis(static_cast<std::size_t>(vectors), PointVector(4 * static_cast<std::size_t>(n), 0.0));
  for (int k = 0; k < vectors; ++k)
    for (int i = 0; i < 3 * n; ++i)
      basis[static_cast<std::size_t>(k)][4 * static_cast<std::size_t>(i / 3) + static_cast<std::size_t>(i % 3)] =
          std::sin(1.0 + 1.7 * i + 0.9 * k * i);
  VectorXd values;
  for (int round = 0; round < rounds; ++round)
  {
    // Rayleigh and Ritz on the images of the basis under the inverse: of K with the old basis, of M with the images
    MatrixXd k_small(vectors, vectors), m_small(vectors, vectors);
    std::vector<PointVector> loads = basis, images = basis;
    for (std::size_t a = 0; a < basis.size(); ++a)
    {
      for (int i = 0; i < n; ++i)
        point(loads[a], i) *= fixed[static_cast<std::size_t>(i)] ? 0.0 : model.mass[i];
      factor.solvePoints(loads[a].data(), images[a].data());
    }
    for (std::size_t a = 0; a < basis.size(); ++a)
      for (std::size_t b = 0; b < basis.size(); ++b)
      {
        double energy = 0.0, inertia = 0.0;
        for (int i = 0; i < n; ++i)
        {
          energy += point(images[a], i).dot(point(loads[b], i));
          inertia += model.mass[i] * point(images[a], i).dot(point(images[b], i));
        }
        k_small(static_cast<Eigen::Index>(a), static_cast<Eigen::Index>(b)) = energy;
        m_small(static_cast<Eigen::Index>(a), static_cast<Eigen::Index>(b)) = inertia;
      }
    const Eigen::GeneralizedSelfAdjointEigenSolver<MatrixXd> ritz(0.5 * (k_small + k_small.transpose()), m_small);
    values = ritz.eigenvalues();
    for (std::size_t a = 0; a < basis.size(); ++a)
    {
      std::fill(basis[a].begin(), basis[a].end(), 0.0);
      for (std::size_t b = 0; b < basis.size(); ++b)
        for (std::size_t i = 0; i < basis[a].size(); ++i)
          basis[a][i] += ritz.eigenvectors()(static_cast<Eigen::Index>(b), static_cast<Eigen::Index>(a)) * images[b][i];
    }
  }
  return values.head(count).cwiseSqrt();
}

VectorXd archFrequencies(const ShellMaterial& material, double radius, double angle, double width, int degree,
                         int count)
{
  const int along = degree + 1, across = degree / 2 + 1, size = along * across;
  const double length = radius * angle;
  VectorXd s_points, s_weights, y_points, y_weights;
  gaussRule(along + 4, s_points, s_weights);
  gaussRule(across + 1, y_points, y_weights);
  RitzSum sum(material, 3 * size);
  MatrixXd strains(6, 3 * size), moves(3, 3 * size);
  for (Eigen::Index a = 0; a < s_points.size(); ++a)
    for (Eigen::Index b = 0; b < y_points.size(); ++b)
    {
      const double s = s_points[a], to_s = 2 / length, to_y = 2 / width;   // d xi / d s
      const Jet end(1 - s * s, -2 * s, -2), ends = product(end, end);
      const std::vector<Jet> in_s = legendre(along, s), in_y = legendre(across, y_points[b]);
      strains.setZero();
      moves.setZero();
      for (int i = 0; i < along; ++i)
        for (int j = 0; j < across; ++j)
        {
          const Jet f = product(end, in_s[static_cast<std::size_t>(i)]), g = in_y[static_cast<std::size_t>(j)],
                    h = product(ends, in_s[static_cast<std::size_t>(i)]);
          const double value = f[0] * g[0], by_s = to_s * f[1] * g[0], by_y = to_y * f[0] * g[1];
          const int u = i * across + j, v = size + u, w = 2 * size + u;
          strains.col(u) << by_s, 0, by_y, by_s / radius, 0, 1.5 * by_y / radius;
          strains.col(v) << 0, by_y, by_s, 0, 0, -0.5 * by_s / radius;
          strains.col(w) << h[0] * g[0] / radius, 0, 0, -to_s * to_s * h[2] * g[0], -to_y * to_y * h[0] * g[2],
              -2 * to_s * to_y * h[1] * g[1];
          moves(0, u) = moves(1, v) = value;
          moves(2, w) = h[0] * g[0];
        }
      sum.add(strains, moves, s_weights[a] * y_weights[b] / (to_s * to_y));
    }
  return sum.frequencies().head(count);
}

VectorXd capFrequencies(const ShellMaterial& material, double radius, double angle, int degree, int count)
{
  std::vector<double> all;
  for (int m = 0; m <= count; ++m)
  {
    const VectorXd of_harmonic = capHarmonic(material, radius, angle, m, degree + 1).head(count);
    for (int copy = 0; copy < (m == 0 ? 1 : 2); ++copy)
      all.insert(all.end(), of_harmonic.data(), of_harmonic.data() + of_harmonic.size());
  }
  std::sort(all.begin(), all.end());
  return Eigen::Map<VectorXd>(all.data(), count);
}

}   // namespace slender::study
