// A naturally curled ribbon, drawn flat and let go again slowly: two helices of opposite handedness meet in a
// perversion (thesis 4.7.2).
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "study/framework/shape_cases.h"
#include "slender_sim/geometry/curves.h"
#include "slender_sim/geometry/rotation.h"
#include "study/framework/cpu_clock.h"
#include "slender_sim/study/study.h"

namespace slender::study {
namespace {

constexpr double kTurns = 12, kThin = 1.0, kWide = 9.0, kRibbonTwist = 1.8 / 1.3;   // section 3 : 1, nu = 0.3; L = 1
constexpr double kRibbonStretch = 1e8;
constexpr double kPitch = 0.003;   ///< [rad] a Slinky of 0.7 mm steel on a radius of 34 mm: turn on turn

/// Natural shape: a helix of kTurns turns whose thin direction d1 points to its axis.
struct Ribbon
{
  RodSetup rod;
  Eigen::Matrix3Xd natural;
  double curvature, torsion;   ///< of the natural shape [1/m]

  Ribbon(int edges, double pitch_angle)
  {
    const double radius = std::cos(pitch_angle) / (2 * M_PI * kTurns);   // a wire of unit length
    curvature = std::pow(std::cos(pitch_angle), 2) / radius;
    torsion = std::sin(pitch_angle) * std::cos(pitch_angle) / radius;
    natural = helixCurve({0, 0, 0}, Eigen::Vector3d::UnitX(), radius, std::sin(pitch_angle) / kTurns, kTurns, edges);
    const Eigen::Matrix3Xd straight = straightCurve({0, 0, 0}, {1, 0, 0}, edges);
    const std::vector<RodSection> sections(edges, sectionOf(kRibbonStretch, kThin, kWide, kRibbonTwist));
    RodModel model = buildRod("ribbon", straight, false, sections, Eigen::Vector3d::UnitZ(), true);
    for (int i = 0; i <= edges; ++i)
    {
      const double l = (i == 0 || i == edges ? 0.5 : 1.0) / edges;
      model.rest_curvature(0, i) = curvature * l;
      model.rest_twist[i] = i == 0 || i == edges ? 0.0 : torsion * l;
    }
    rod.state = makeRodState(model, straight, Eigen::Vector3d::UnitZ());
    rod.model = std::make_shared<const RodModel>(std::move(model));
    rod.inputs.gravity.setZero();
    Eigen::Matrix3d flat;   // columns t, d1, d2
    flat << 1, 0, 0, 0, 0, -1, 0, 1, 0;
    for (int k : {0, 1})
    {
      rod.hold(k * edges, k * edges, true);
      rod.state.grasps[k].X_WG.orientation = rod.inputs.grasps[k].X_WG.orientation = Eigen::Quaterniond(flat);
    }
  }

  /// Straight and untwisted, with this tension: what fingers travelling along the ribbon leave behind.
  void drawFlat(double tension)
  {
    const double end = 1 + tension / kRibbonStretch;
    lay(rod, straightCurve({0, 0, 0}, {end, 0, 0}, rod.model->edges()), Eigen::Vector3d::UnitZ());
    rod.state.grasps[1].X_WG.position = rod.inputs.grasps[1].X_WG.position = {end, 0, 0};
  }
};

/// Tension at which the clamped flat ribbon buckles: B z'''' = (F - A^2 K^2 / C) z'', psi = -(A K / C) z with z = z' =
/// 0 at the ends.
double criticalTension(double curvature)
{
  return std::pow(kThin * curvature, 2) / kRibbonTwist - 4 * M_PI * M_PI * kWide;
}

/// Curvature and torsion [1/m] of a helix.
struct Helix
{
  double curvature, torsion;
};

/// The helix of least energy under a tension when its ends may turn freely, as the two halves of a perversion let each
/// other do: least A/2 (k - K)^2 + C/2 (t - T)^2 - F |t| / r over k = r sin(a), t = +- r cos(a); r follows for each a,
/// and a by golden section.
Helix helixUnderTension(const Ribbon& ribbon, double tension, double handedness)
{
  const double rest = handedness * ribbon.torsion;
  const auto rate = [&](double a) {
    const double s = std::sin(a), c = std::cos(a);
    return (kThin * ribbon.curvature * s + kRibbonTwist * rest * c) / (kThin * s * s + kRibbonTwist * c * c);
  };
  const auto energy = [&](double a) {
    const double k = rate(a) * std::sin(a) - ribbon.curvature, t = rate(a) * std::cos(a) - rest;
    return 0.5 * (kThin * k * k + kRibbonTwist * t * t) - tension * std::cos(a);
  };
  double low = 0.01, high = 0.5 * M_PI;
  const double ratio = 0.5 * (std::sqrt(5.0) - 1);
  while (high - low > 1e-9)
  {
    const double p = high - ratio * (high - low), q = low + ratio * (high - low);
    (energy(p) < energy(q) ? high : low) = energy(p) < energy(q) ? q : p;
  }
  return {rate(low) * std::sin(low), handedness * rate(low) * std::cos(low)};
}

/// What the centreline alone shows.
struct Centreline
{
  std::vector<double> k, t;   ///< curvature and torsion per edge [1/m]; zero at the ends
  /// mean over one natural turn, weighted with curvature squared: straight parts do not count
  std::vector<double> torsion;

  explicit Centreline(const Eigen::Matrix3Xd& x) : k(x.cols() - 1, 0.0), t(x.cols() - 1, 0.0)
  {
    const int edges = static_cast<int>(x.cols()) - 1, half = static_cast<int>(edges / kTurns / 2);
    const auto edge = [&](int j) { return Eigen::Vector3d(x.col(j + 1) - x.col(j)); };
    for (int j = 1; j + 1 < edges; ++j)
    {
      const Eigen::Vector3d before = edge(j - 1).cross(edge(j)), after = edge(j).cross(edge(j + 1));
      const double l = edge(j).norm();
      k[j] =
          0.5 *
          (std::atan2(before.norm(), edge(j - 1).dot(edge(j))) + std::atan2(after.norm(), edge(j).dot(edge(j + 1)))) /
          l;
      t[j] = signedAngle(before.normalized(), after.normalized(), edge(j) / l) / l;
    }
    for (int j = 0; j < edges; ++j)
    {
      double weight = 0, turned = 0;
      for (int i = std::max(1, j - half); i <= std::min(edges - 2, j + half); ++i)
      {
        weight += k[i] * k[i];
        turned += k[i] * k[i] * t[i];
      }
      torsion.push_back(weight > 0 ? turned / weight : 0.0);
    }
  }

  /// Mean over the middle of one half: away from clamps and perversion.
  Helix middleOf(int side) const
  {
    const int edges = static_cast<int>(k.size());
    const int from = static_cast<int>(edges * (0.15 + 0.5 * side)), to = from + edges / 5;
    Helix mean{0, 0};
    for (int j = from; j < to; ++j)
    {
      mean.curvature += k[j] / (to - from);
      mean.torsion += t[j] / (to - from);
    }
    return mean;
  }

  /// Lengths (as parts of the rod) of the stretches of one handedness, in order; sign +: right-handed. Weak torsion,
  /// under a tenth of the largest, belongs to none.
  std::vector<double> stretches() const
  {
    double most = 0;
    for (const double t : torsion)
      most = std::max(most, std::abs(t));
    std::vector<double> found;
    const double part = 1.0 / torsion.size();
    for (const double t : torsion)
    {
      if (std::abs(t) <= 0.1 * most)
        continue;
      const double sign = t > 0 ? 1.0 : -1.0;
      if (found.empty() || found.back() * sign < 0)
        found.push_back(0.0);
      found.back() += sign * part;
    }
    return found;
  }
};

void releaseRibbon(StudyContext& context, int edges)
{
  Ribbon ribbon(edges, kPitch);
  ribbon.drawFlat(1.2 * criticalTension(ribbon.curvature));
  RodStepper stepper(ribbon.rod.model, timeConfig(Integrator::implicit_euler, 1.0, 1e-9));
  Plot& picture =
      context.plot("perversion_shapes_" + std::to_string(edges),
                   "Natural (top), drawn flat (middle) and released (bottom); height drawn larger", "x [L]", "z [L]");
  Plot& profile = context.plot("perversion_torsion_" + std::to_string(edges),
                               "Torsion of the centreline, mean over a turn", "s [L]", "torsion [1/L]");
  picture.log_x = picture.log_y = picture.markers = profile.log_x = profile.log_y = profile.markers = false;
  const auto draw = [&](const std::string& label, const Eigen::Matrix3Xd& x, double across, double up) {
    Series& s = picture.at(label);
    for (int i = 0; i < x.cols(); ++i)
    {
      s.x.push_back(across + x(0, i) + 0.5 * x(1, i));   // seen from the side and from above
      s.y.push_back(up + x(2, i) + 0.2 * x(1, i));
    }
  };
  draw("natural", ribbon.natural, 0.2, 0.11);
  draw("drawn flat", ribbon.rod.state.x, 0.0, 0.065);

  for (const double target : {0.9, 0.8, 0.7, 0.6, 0.5, 0.45})
  {
    const double begin = threadSeconds();
    double& x = ribbon.rod.inputs.grasps[1].X_WG.position.x();
    std::string refused;
    bool stable = true;
    for (const double from = x; refused.empty() && x > target;)
    {
      x = std::max(target, x - std::min(0.02, from - target));
      const StepReport report = stepper.solveEquilibrium(ribbon.rod.state, ribbon.rod.inputs);
      refused = report.message;
      stable = report.stable;
    }
    const Centreline line(ribbon.rod.state.x);
    const std::vector<double> stretches = line.stretches();
    const double tension = stepper.wrenches()[0].force.x();
    const auto newRow = [&](const char* quantity) -> Row& {
      return context.row().set("quantity", quantity).set("edges", edges).set("ends_apart", target);
    };
    Row& row = newRow("perversions");
    row.check(refused.empty() && stable ? static_cast<double>(stretches.size()) - 1 : NAN, 1, 0.5,
              "one change of handedness");
    row.set("tension", tension).set("cpu_seconds", threadSeconds() - begin);
    if (!refused.empty())
      row.set("refused", refused);
    if (stretches.size() == 2)
      newRow("left-handed share")
          .check(std::abs(std::min(stretches[0], stretches[1])) / (std::abs(stretches[0]) + std::abs(stretches[1])),
                 0.5, 0.05, "mirror images");
    for (const int side : {0, 1})
    {
      const Helix half = line.middleOf(side);
      const Helix exact = helixUnderTension(ribbon, tension, half.torsion > 0 ? 1.0 : -1.0);
      Row& bent = newRow(side ? "right curvature" : "left curvature").set("tension", tension);
      Row& wound = newRow(side ? "right torsion" : "left torsion").set("tension", tension);
      const char* source = "helix of least energy under this tension";
      if (target > 0.85)   // near the threshold the halves have not grown into helices yet
      {
        bent.set("measured", half.curvature).set("expected", exact.curvature);
        wound.set("measured", half.torsion).set("expected", exact.torsion);
        continue;
      }
      bent.check(half.curvature, exact.curvature, 0.05 * exact.curvature, source)
          .set("relative_error", half.curvature / exact.curvature - 1);
      wound.check(half.torsion, exact.torsion, 0.05 * std::abs(exact.torsion), source)
          .set("relative_error", half.torsion / exact.torsion - 1);
    }
    Series& s = profile.at("ends " + std::to_string(target).substr(0, 4) + " L apart");
    // means over less than a turn are left out
    const std::size_t margin = static_cast<std::size_t>(edges / kTurns / 2);
    for (std::size_t j = margin; j + margin < line.torsion.size(); ++j)
    {
      s.x.push_back((j + 0.5) / edges);
      s.y.push_back(line.torsion[j]);
    }
  }
  draw("released", ribbon.rod.state.x, 0.0, 0.0);
}

}   // namespace

void runPerversion(StudyContext& context)
{
  const std::vector<int> per_turn = context.quick() ? std::vector<int>{16} : std::vector<int>{16, 32, 64};
  for (const int k : per_turn)
  {
    const int edges = static_cast<int>(k * kTurns);
    context.progress(k, 64, "critical tension");
    Ribbon ribbon(edges, kPitch);
    const double expected = criticalTension(ribbon.curvature);
    double low = 0.5 * expected, high = 1.5 * expected;
    while (high - low > 1e-6 * expected)
    {
      const double middle = 0.5 * (low + high);
      ribbon.drawFlat(middle);
      (unstableModes(*ribbon.rod.model, ribbon.rod.state, ribbon.rod.inputs.gravity) ? low : high) = middle;
    }
    context.row()
        .set("quantity", "critical tension")
        .set("edges", edges)
        .check(high, expected, 0.01 * expected, "linear stability, A^2 K^2/C - 4 pi^2 B/L^2")
        .set("relative_error", high / expected - 1);
    context.progress(k, 64, "release");
    releaseRibbon(context, edges);
  }
  double perversions = 0;
  for (const Row& row : context.rows())
    if (std::get<std::string>(*row.find("quantity")) == "perversions")
      perversions = std::get<double>(*row.find("measured"));
  context.metric("perversions", perversions);
  context.note(
      "Section 3 : 1 (B = 9 A, C = 1.385 A), 12 natural turns on the unit length. Without contact: with the ends "
      "nearer than about 0.4 L a loop");
  context.note(
      "would pass through itself and undo the perversion. The helix theory is that of infinite halves: six turns each "
      "leave a few percent.");
}

const StudyRegistration kPerversionRegistration{
    "perversion", "a curled ribbon drawn flat and released: two helices of opposite handedness", runPerversion};

}   // namespace slender::study
