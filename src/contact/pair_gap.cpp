#include "pair_gap.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "slender_sim/contact/distance.h"

namespace slender {

namespace {

using Vector = Eigen::Vector3d;

constexpr double kTriangleSoftness = 0.5;     // six triangles share a corner, two an edge
constexpr double kPlaneSoftness = 0.1;        // for bounds: keeps the minimum unique, and the bound close
constexpr double kLeastDeterminant = 1e-15;   // of the product of a matrix' diagonal entries

/// A place of a triangle, seen from a convex piece.
struct FacePlace
{
  Vector weights;
  double gap, phi;
  Vector normal, slopes;   ///< of the distance in the weights
  double c00, c01, c11;    ///< second derivatives of the distance along the two edges from corner 0
  double ratio() const { return gap / phi; }
};

FacePlace placeAt(const ConvexPiece& piece, const Vector* corner, double thickness, double softness,
                  const Vector& weights)
{
  const Vector p = weights[0] * corner[0] + weights[1] * corner[1] + weights[2] * corner[2];
  const Vector e = corner[1] - corner[0], f = corner[2] - corner[0];
  const PieceDistance from = pieceDistance(piece, p);
  const Vector bend = from.curvature * f;
  FacePlace at;
  at.weights = weights;
  at.gap = from.distance - thickness;
  at.phi = 1.0 - softness * (1.5 * weights.squaredNorm() - 0.5);
  at.normal = from.normal;
  at.c00 = std::max(0.0, e.dot(from.curvature * e));   // without the negative rest of rounding
  at.c01 = e.dot(bend);
  at.c11 = std::max(0.0, f.dot(bend));
  for (int k = 0; k < 3; ++k)
    at.slopes[k] = at.normal.dot(corner[k] - p);
  return at;
}

/// Quadratic function of the two parameters (weights of corners 1 and 2), from a place on.
struct Model
{
  double g0, g1, k00, k01, k11;
  double value(double s, double t) const { return g0 * s + g1 * t + 0.5 * (k00 * s * s + k11 * t * t) + k01 * s * t; }
};

/// The weights at which a convex quadratic function is smallest on the triangle.
Vector minimumOnTriangle(const Model& m, const Vector& from)
{
  const double s0 = from[1], t0 = from[2];
  const double det = m.k00 * m.k11 - m.k01 * m.k01;
  if (m.k00 > 0.0 && det > kLeastDeterminant * m.k00 * m.k11)
  {
    const double s = s0 + (m.k01 * m.g1 - m.k11 * m.g0) / det, t = t0 + (m.k01 * m.g0 - m.k00 * m.g1) / det;
    if (s > 0.0 && t > 0.0 && s + t < 1.0)
      return {1.0 - s - t, s, t};
  }
  Vector best = from;
  double least = std::numeric_limits<double>::infinity();
  for (int k = 0; k < 3; ++k)   // along the edge from corner k to the next one
  {
    const int next = (k + 1) % 3;
    const Vector start = Vector::Unit(k);
    const double ds = (next == 1) - (k == 1), dt = (next == 2) - (k == 2);
    const double s = start[1] - s0, t = start[2] - t0;
    const double slope = ds * (m.g0 + m.k00 * s + m.k01 * t) + dt * (m.g1 + m.k01 * s + m.k11 * t);
    const double curvature = ds * ds * m.k00 + 2.0 * ds * dt * m.k01 + dt * dt * m.k11;
    const double along = slope >= 0.0 ? 0.0 : -slope < curvature ? -slope / curvature : 1.0;
    const double value = m.value(s + along * ds, t + along * dt);
    if (value < least)
    {
      least = value;
      best = Vector::Zero();
      best[k] = 1.0 - along;
      best[next] = along;
    }
  }
  return best;
}

/// The place where gap / phi is smallest. At the minimum G the function gap - G phi, which is strictly convex, has its
/// own minimum, which is 0. Each iteration minimises a quadratic model of it with the present ratio for G
/// [Dinkelbach, On nonlinear fractional programming, 1967].
FacePlace minimiseOverTriangle(const ConvexPiece& piece, const Vector* corner, double thickness, double softness)
{
  constexpr int kMostIterations = 60;
  constexpr double kLastStep = 1e-8;   // of a weight; the next one would be about its square
  FacePlace at = placeAt(piece, corner, thickness, softness, Vector::Constant(1.0 / 3.0));
  for (int k = 0; k < kMostIterations && at.gap > 0.0; ++k)
  {
    const double ratio = at.ratio(), bend = 3.0 * softness * ratio;
    const Vector gradient = at.slopes + bend * at.weights;
    const Model model{gradient[1] - gradient[0], gradient[2] - gradient[0], at.c00 + 2.0 * bend, at.c01 + bend,
                      at.c11 + 2.0 * bend};
    const Vector step = minimumOnTriangle(model, at.weights) - at.weights;
    const double size = step.cwiseAbs().maxCoeff(), slope = gradient.dot(step);
    if (!(slope < 0.0))
      break;
    const double noise = 4e-16 * (at.gap + thickness + at.slopes.cwiseAbs().maxCoeff());
    const auto trialAt = [&](double share) {
      // The full step ends exactly on the edges that it leads to.
      Vector w = share == 1.0 ? Vector(at.weights + step).cwiseMax(0.0) : Vector(at.weights + share * step);
      for (int i = 0; i < 3; ++i)
        if (share == 1.0 && w[i] < 1e-15)
          w[i] = 0.0;
      return placeAt(piece, corner, thickness, softness, w);
    };
    double share = 1.0;
    FacePlace trial = trialAt(share);
    const auto better = [&] { return trial.gap - ratio * trial.phi <= 1e-4 * share * slope + noise; };
    while (!better() && share > 1e-6)
    {
      share *= 0.5;
      trial = trialAt(share);
    }
    if (!better())
      break;
    at = trial;
    if (size * share < kLastStep)
      break;
  }
  return at;
}

/// Parameters of a triangle that are free: weights move from its first corner that counts to the others.
void addFaceMotion(const FacePlace& at, PairGap& out)
{
  const double q = out.weight, bend = 3.0 * kTriangleSoftness * out.gap;
  int counting[3], n = 0;
  for (int k = 0; k < 3; ++k)
    if (at.weights[k] > 0.0)
      counting[n++] = k;
  const auto curvature = [&](int i, int j) {   // along edges i and j from corner 0; the edge to itself is zero
    return i == 0 || j == 0 ? 0.0 : i != j ? at.c01 : i == 1 ? at.c00 : at.c11;
  };
  double h[2][2] = {};
  for (int a = 1; a < n; ++a)
    for (int b = 1; b < n; ++b)
    {
      const int o = counting[0], i = counting[a], j = counting[b];
      h[a - 1][b - 1] = q * (curvature(i, j) - curvature(i, o) - curvature(o, j) + curvature(o, o) +
                             bend * (1.0 + (i == j ? 1.0 : 0.0)));
    }
  for (int a = 1; a < n; ++a)
  {
    // The derivative of 1 / phi along the parameter.
    const double rise = 3.0 * kTriangleSoftness * q * q * (at.weights[counting[a]] - at.weights[counting[0]]);
    Eigen::Vector4d& along = out.motion.along[a - 1];
    along = rise * out.place;
    along[counting[a]] += q;
    along[counting[0]] -= q;
  }
  const bool sound = h[0][0] > 0.0 && (n < 3 || h[0][0] * h[1][1] - h[0][1] * h[0][1] > 0.0);
  out.motion.count = sound ? n - 1 : 0;
  out.motion.h00 = h[0][0];
  out.motion.h01 = h[0][1];
  out.motion.h11 = h[1][1];
}

PairGap trianglePieceGap(const Vector* corner, double thickness, const ConvexPiece& piece)
{
  const FacePlace at = minimiseOverTriangle(piece, corner, thickness, kTriangleSoftness);
  PairGap out;
  out.weight = 1.0 / at.phi;
  out.gap = at.gap * out.weight;
  out.distance = at.gap + thickness;
  out.normal = at.normal;
  out.place.head<3>() = at.weights;
  addFaceMotion(at, out);
  return out;
}

PairGap segmentPieceGap(const Vector* corner, double thickness, const ConvexPiece& piece)
{
  const SoftGap soft = softGap(corner[0], corner[1], thickness, piece);
  PairGap out;
  out.weight = soft.weight;
  out.gap = soft.gap;
  out.distance = soft.gap / soft.weight + thickness;
  out.normal = soft.normal;
  out.place = {1.0 - soft.t, soft.t, 0, 0};
  out.motion.count = soft.free_t;
  out.motion.along[0] = soft.weight * Eigen::Vector4d(-1, 1, 0, 0);   // only the rate of convergence could tell
  out.motion.h00 = soft.htt;
  return out;
}

}   // namespace

PairGap edgesGap(const Vector& a0, const Vector& a1, const Vector& b0, const Vector& b1, double thickness,
                 bool with_motion)
{
  const SoftGap soft = softGap(a0, a1, b0, b1, thickness);
  PairGap out;
  out.gap = soft.gap;
  out.distance = soft.distance;
  out.weight = soft.weight;
  out.normal = soft.normal;
  out.place = {1.0 - soft.s, soft.s, soft.t - 1.0, -soft.t};
  if (!with_motion)
    return out;
  PlaceMotion& m = out.motion;
  if (soft.free_s)
  {
    m.along[0] = soft.weight * Eigen::Vector4d(-1, 1, 0, 0) + soft.weight_s * out.place;
    m.turn[0] = soft.turn_s;
    m.h00 = soft.hss;
    m.count = 1;
  }
  if (soft.free_t)
  {
    m.along[m.count] = soft.weight * Eigen::Vector4d(0, 0, 1, -1) + soft.weight_t * out.place;
    m.turn[m.count] = soft.turn_t;
    (m.count > 0 ? m.h11 : m.h00) = soft.htt;
    m.h01 = soft.hst;
    ++m.count;
  }
  return out;
}

PairGap pointTriangleGap(const Vector& p, const Vector& a, const Vector& b, const Vector& c, double thickness)
{
  const Vector* const corner[3] = {&a, &b, &c};
  const Vector w = closestOnTriangle(p, a, b, c), u = p - w[0] * a - w[1] * b - w[2] * c;
  PairGap out;
  out.distance = u.norm();
  out.gap = out.distance - thickness;
  if (!(out.gap > 0.0))
    return out;
  out.normal = u / out.distance;
  out.place = {1.0, -w[0], -w[1], -w[2]};
  int first = 0;
  while (!(w[first] > 0.0))
    ++first;
  Vector across[2];   // the edges on which the place moves, less what goes along the normal
  for (int k = first + 1; k < 3; ++k)
    if (w[k] > 0.0)
    {
      const int n = out.motion.count++;
      const Vector e = *corner[k] - *corner[first];
      across[n] = e - out.normal.dot(e) * out.normal;
      out.motion.along[n] = Eigen::Vector4d::Unit(first + 1) - Eigen::Vector4d::Unit(k + 1);
      out.motion.turn[n] = -across[n] / out.distance;
    }
  const int n = out.motion.count;
  out.motion.h00 = n > 0 ? across[0].squaredNorm() / out.distance : 0.0;
  out.motion.h01 = n > 1 ? across[0].dot(across[1]) / out.distance : 0.0;
  out.motion.h11 = n > 1 ? across[1].squaredNorm() / out.distance : 0.0;
  return out;
}

PairGap facePieceGap(const Vector* corner, int corners, double thickness, const ConvexPiece& piece)
{
  if (corners == 3)
    return trianglePieceGap(corner, thickness, piece);
  if (corners == 2)
    return segmentPieceGap(corner, thickness, piece);
  const PieceDistance at = pieceDistance(piece, corner[0]);
  PairGap out;
  out.distance = at.distance;
  out.gap = at.distance - thickness;
  out.normal = at.normal;
  out.place = {1, 0, 0, 0};
  return out;
}

double leastFaceDistance(const ConvexPiece& piece, const Vector* corner, int corners)
{
  Vector middle = Vector::Zero();
  for (int k = 0; k < corners; ++k)
    middle += corner[k] / corners;
  const PieceDistance at = pieceDistance(piece, middle);
  double least = 0.0;
  for (int k = 0; k < corners; ++k)
    least = std::min(least, at.normal.dot(corner[k] - middle));
  return std::max(0.0, at.distance + least);
}

namespace {

/// The largest n . x on a convex piece; infinite for a plane.
double supportOf(const ConvexPiece& piece, const Vector& n)
{
  if (const auto* s = std::get_if<Sphere>(&piece))
    return s->radius * n.norm();
  if (const auto* b = std::get_if<Box>(&piece))
    return 0.5 * b->size.dot(n.cwiseAbs());
  if (const auto* c = std::get_if<Cylinder>(&piece))
    return c->radius * n.head<2>().norm() + 0.5 * c->length * std::abs(n.z());
  if (const auto* k = std::get_if<Capsule>(&piece))
    return k->radius * n.norm() + 0.5 * k->length * std::abs(n.z());
  if (const auto* t = std::get_if<Triangle>(&piece))
    return std::max({n.dot((*t)[0]), n.dot((*t)[1]), n.dot((*t)[2])});
  return std::numeric_limits<double>::infinity();
}

}   // namespace

FacePlane separatingPlane(const ConvexPiece& piece, const Vector* corner, int corners, double thickness)
{
  FacePlane out{0.0, false, corner[0], Vector::UnitZ()};
  Vector place = corner[0];
  if (corners == 3)
  {
    const FacePlace at = minimiseOverTriangle(piece, corner, thickness, kPlaneSoftness);
    place = at.weights[0] * corner[0] + at.weights[1] * corner[1] + at.weights[2] * corner[2];
    out.distance = at.gap + thickness;
    out.normal = at.normal;
  }
  else if (corners == 2)
  {
    const SegmentPieceDistance at = segmentPieceDistance(piece, corner[0], corner[1]);
    place += at.t * (corner[1] - corner[0]);
    out.distance = at.distance;
    out.normal = at.normal;
  }
  else
  {
    const PieceDistance at = pieceDistance(piece, place);
    out.distance = at.distance;
    out.normal = at.normal;
  }
  out.meets = !(out.distance > thickness);
  const auto lowestAlong = [&](const Vector& n) {
    int lowest = 0;
    for (int k = 1; k < corners; ++k)
      if (n.dot(corner[k] - corner[lowest]) < 0.0)
        lowest = k;
    return corner[lowest];
  };
  out.foot = lowestAlong(out.normal);
  out.distance += out.normal.dot(out.foot - place);
  if (corners < 3)
    return out;
  // The plane of a small face of the piece cuts the far corners of a wide triangle, even if it is hardly tilted.
  Vector n = (corner[1] - corner[0]).cross(corner[2] - corner[0]).normalized();
  if (n.dot(out.normal) < 0.0)
    n = -n;
  const Vector foot = lowestAlong(n);
  if (const double distance = n.dot(foot) - supportOf(piece, n); distance > out.distance)
    return {distance, out.meets, foot, n};
  return out;
}

}   // namespace slender
