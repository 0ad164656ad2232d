// Twist of a naturally curved rod of flat section whose one end is turned (thesis Fig. 4.2): the bend keeps it on the
// turned side.
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "study/framework/shape_cases.h"
#include "study/framework/cpu_clock.h"
#include "slender_sim/study/study.h"

namespace slender::study {
namespace {

/// a flat ellipse, 2 : 1, bent the easy way; nu = 0.3; L = 1
constexpr double kWeak = 1.0, kStrong = 4.0, kTwistModulus = 1.6 / 1.3;
constexpr double kBend = 1.0 / 12;   ///< length of the V's bend: four edges of 48
constexpr double kTurnStep = 0.05;   ///< [rad]

struct RestShape
{
  const char* name;
  double turn, length;   ///< of the bend in the middle [rad], [L]
  double angle(double s) const { return turn * std::clamp((s - 0.5) / length + 0.5, 0.0, 1.0); }
  double curvature(double s) const { return std::abs(s - 0.5) < 0.5 * length ? turn / length : 0.0; }
};
constexpr RestShape kRestShapes[] = {{"V", M_PI / 2, kBend}, {"semicircle", M_PI, 1.0}};

/// Twist on the clamped and on the turned side of the middle [rad].
struct Halves
{
  double clamped, turned;
  double share() const { return turned / (clamped + turned); }
};

/// The smooth rod with its centreline held: psi is the angle by which sections have turned from their natural place,
///   C psi'' = k(s)^2 (B1 (1 - cos psi) sin psi + B2 sin psi cos psi),  psi(0) = 0, psi(1) = Theta.
/// Finite differences on a fine grid; each new Theta starts from the last state and goes downhill in energy (proximal
/// Newton).
class HeldCurve
{
public:
  explicit HeldCurve(const RestShape& shape) : k2_(kIntervals + 1), psi_(kIntervals + 1, 0.0)
  {
    for (int i = 0; i <= kIntervals; ++i)   // mean over the cell, so that the bend's ends fall where they should
      for (int q = 0; q < 16; ++q)
        k2_[i] += std::pow(shape.curvature((i - 0.5 + (q + 0.5) / 16) / kIntervals), 2) / 16;
  }

  void turnTo(double theta)
  {
    const double last = psi_[kIntervals];
    for (int i = 0; i <= kIntervals; ++i)
      psi_[i] += (theta - last) * std::pow(static_cast<double>(i) / kIntervals, 8);   // at the turned end
    double weight = 1e4;
    for (int round = 0; round < 400; ++round)
    {
      double change = 0;
      const bool definite = newton(weight, change);
      if (change < 1e-10 && weight == 0)
        return;
      weight = !definite ? std::max(10 * weight, 1.0) : change < 1e-2 ? (weight > 1e-3 ? 0.1 * weight : 0.0) : weight;
    }
    throw std::runtime_error("held curve: no equilibrium");
  }

  Halves halves() const { return {psi_[kIntervals / 2], psi_[kIntervals] - psi_[kIntervals / 2]}; }
  double at(double s) const { return psi_[static_cast<std::size_t>(std::lround(s * kIntervals))]; }

private:
  /// One step with `weight` |change|^2 / 2 per length added; does nothing but say so when the matrix is not definite.
  bool newton(double weight, double& change)
  {
    const double h = 1.0 / kIntervals, c = kTwistModulus / h;
    std::vector<double> diagonal(kIntervals + 1, 1.0), right(kIntervals + 1, 0.0);
    for (int i = 1; i < kIntervals; ++i)
    {
      const double s = std::sin(psi_[i]), z = std::cos(psi_[i]);
      right[i] = c * (psi_[i + 1] - 2 * psi_[i] + psi_[i - 1]) - h * k2_[i] * (kWeak * (1 - z) * s + kStrong * s * z);
      diagonal[i] = 2 * c + h * k2_[i] * (kWeak * (z - z * z + s * s) + kStrong * (z * z - s * s)) + h * weight;
      if (i > 1)
      {
        const double factor = c / diagonal[i - 1];
        diagonal[i] -= factor * c;
        right[i] += factor * right[i - 1];
      }
      if (diagonal[i] <= 0)
      {
        change = std::numeric_limits<double>::infinity();
        return false;
      }
    }
    change = 0;
    for (int i = kIntervals - 1; i > 0; --i)
    {
      right[i] = (right[i] + c * (i + 1 < kIntervals ? right[i + 1] : 0.0)) / diagonal[i];
      change = std::max(change, std::abs(right[i]));
    }
    const double shorten = std::min(1.0, 0.3 / change);
    for (int i = 1; i < kIntervals; ++i)
      psi_[i] += shorten * right[i];
    return true;
  }

  static constexpr int kIntervals = 1920;
  std::vector<double> k2_, psi_;
};

/// The discrete rod; its centreline held by pins at every node, or free between the clamps.
class TurnedRod
{
public:
  TurnedRod(const RestShape& shape, int edges, bool held) : edges_(edges)
  {
    Eigen::Matrix3Xd nodes = Eigen::Matrix3Xd::Zero(3, edges + 1);
    for (int j = 0; j < edges; ++j)
    {
      const double a = shape.angle((j + 0.5) / edges);
      nodes.col(j + 1) = nodes.col(j) + Eigen::Vector3d(std::cos(a), 0, std::sin(a)) / edges;
    }
    rod_ = naturalRod(sectionOf(1e6, kWeak, kStrong, kTwistModulus), nodes, Eigen::Vector3d::UnitZ());
    rod_.hold(0, 0, true);
    rod_.hold(edges, edges, true);
    for (int i = 1; held && i < edges; ++i)
      rod_.hold(i, i, false);
    start_ = rod_.inputs.grasps[1].X_WG.orientation;
    TimeConfig time = timeConfig(Integrator::implicit_euler, 1.0, 1e-9);
    time.newton.max_iterations = 1000;   // a jump has far to go
    stepper_ = std::make_unique<RodStepper>(rod_.model, time);
  }

  StepReport turnTo(double theta)
  {
    // x: the section's tangent
    rod_.inputs.grasps[1].X_WG.orientation = start_ * Eigen::AngleAxisd(theta, Eigen::Vector3d::UnitX());
    return stepper_->solveEquilibrium(rod_.state, rod_.inputs);
  }

  /// Angle of edge j against the clamped section, in excess of the natural one [rad]; j = edges: of the turned section.
  double at(int edge) const
  {
    double sum = rod_.state.grasps[0].section_twist[1];
    for (int i = 1; i <= std::min(edge, edges_ - 1); ++i)
      sum += rod_.state.twist[i];
    return sum + (edge == edges_ ? rod_.state.grasps[1].section_twist[0] : 0.0);
  }
  Halves halves() const
  {
    const double middle = 0.5 * (at(edges_ / 2 - 1) + at(edges_ / 2));
    return {middle, at(edges_) - middle};
  }
  const Eigen::Matrix3Xd& nodes() const { return rod_.state.x; }

private:
  int edges_;
  RodSetup rod_;
  Eigen::Quaterniond start_;
  std::unique_ptr<RodStepper> stepper_;
};

/// Turns one end up to `last`; after every step `look`(theta). Returns why it stopped early, or nothing.
template <class Look>
std::string turnUp(TurnedRod& rod, double last, Look look)
{
  for (int k = 1; k * kTurnStep < last + 1e-9; ++k)
  {
    const StepReport report = rod.turnTo(k * kTurnStep);
    if (!report.ok)
      return report.message;
    look(k * kTurnStep);
  }
  return "";
}

bool isAt(const std::vector<double>& list, double theta)
{
  return std::any_of(list.begin(), list.end(), [&](double t) { return std::abs(t - theta) < 0.5 * kTurnStep; });
}

void addProfile(Plot& plot, const std::string& label, const TurnedRod& rod, int edges)
{
  Series& s = plot.at(label);
  for (int j = 0; j <= edges; ++j)
  {
    s.x.push_back(j < edges ? (j + 0.5) / edges : 1.0);
    s.y.push_back(rod.at(j) / (2 * M_PI));
  }
}

std::string shortText(double value)
{
  char text[32];
  std::snprintf(text, sizeof text, "%g", value);
  return text;
}

/// Centreline held where it naturally is: against the smooth rod.
void holdCentreline(StudyContext& context, const RestShape& shape, const std::vector<int>& meshes)
{
  const std::vector<double> looks = {1, 2, 4, 6, 10, 15, 17, 21, 25, 30, 33};   // well apart from the V's jumps
  const std::vector<double> profiles = {2, 6, 17, 21};
  Plot& share = context.plot(std::string("twist_asymmetry_share_") + shape.name,
                             std::string(shape.name) + ", centreline held: twist on the turned side",
                             "applied angle [turns]", "share of the twist");
  Plot& profile = context.plot(std::string("twist_asymmetry_profile_") + shape.name,
                               std::string(shape.name) + ", centreline held, n = 49: angle of sections", "s [L]",
                               "angle from the natural place [turns]");
  for (Plot* p : {&share, &profile})
    p->log_x = p->log_y = p->markers = false;

  std::vector<Halves> exact;   // by step
  {
    HeldCurve curve(shape);
    for (int k = 1; k * kTurnStep < looks.back() + 1e-9; ++k)
    {
      curve.turnTo(k * kTurnStep);
      exact.push_back(curve.halves());
      share.at("smooth rod").x.push_back(k * kTurnStep / (2 * M_PI));
      share.at("smooth rod").y.push_back(exact.back().share());
    }
  }
  const auto jump = [](const std::vector<Halves>& path) {   // where the clamped half takes over most of a turn at once
    for (std::size_t k = 1; k < path.size(); ++k)
      if (path[k].clamped - path[k - 1].clamped > M_PI)
        return static_cast<double>(k + 1) * kTurnStep;
    return 0.0;
  };
  for (const int edges : meshes)
  {
    context.progress(edges, meshes.back(), std::string(shape.name) + ", held");
    TurnedRod rod(shape, edges, true);
    std::vector<Halves> path;
    const double coarse = 48.0 / edges;
    const std::string refused = turnUp(rod, looks.back(), [&](double theta) {
      path.push_back(rod.halves());
      const Halves& smooth = exact[path.size() - 1];
      share.at("n = " + std::to_string(edges + 1)).x.push_back(theta / (2 * M_PI));
      share.at("n = " + std::to_string(edges + 1)).y.push_back(path.back().share());
      if (!isAt(looks, theta))
        return;
      context.row()
          .set("shape", shape.name)
          .set("centreline", "held")
          .set("vertices", edges + 1)
          .set("turned_by_rad", theta)
          .set("quantity", "share of the turned half")
          .set("twist_turned", path.back().turned)
          .set("twist_clamped", path.back().clamped)
          .check(path.back().share(), smooth.share(), 0.02 * coarse,
                 "smooth rod, its balance of twist solved on a fine grid");
      if (edges == 48 && isAt(profiles, theta))
        addProfile(profile, "turned by " + shortText(theta) + " rad", rod, edges);
    });
    Row& row = context.row();
    row.set("shape", shape.name)
        .set("centreline", "held")
        .set("vertices", edges + 1)
        .set("quantity", "angle of the first jump [rad]");
    if (!refused.empty())
      row.check(std::numeric_limits<double>::quiet_NaN(), jump(exact), 1, "").set("refused", refused);
    else if (jump(exact) > 0)
      row.check(jump(path), jump(exact), 0.1 * coarse * jump(exact),
                "smooth rod, its balance of twist solved on a fine grid");
    else
      row.check(jump(path), 0, 0.5 * kTurnStep, "none in the smooth rod");
  }
}

/// Centreline free between the clamps: against a refined rod. Larger angles would push the rod through itself.
void freeCentreline(StudyContext& context, const RestShape& shape, int fine)
{
  const std::vector<double> looks = {1, 2, 3, 4, 5};
  Plot& picture = context.plot(std::string("twist_asymmetry_free_") + shape.name,
                               std::string(shape.name) + ", centreline free, n = 49: seen from the side and above",
                               "x + y/2 [L]", "z + y/2 [L]");
  Plot& profile = context.plot(std::string("twist_asymmetry_free_profile_") + shape.name,
                               std::string(shape.name) + ", centreline free, n = 49: twist up to here", "s [L]",
                               "twist from the clamp [turns]");
  for (Plot* p : {&picture, &profile})
    p->log_x = p->log_y = p->markers = false;
  picture.equal_axes = true;
  std::vector<double> refined;
  for (const int edges : {fine, 48})
  {
    TurnedRod rod(shape, edges, false);
    std::size_t look = 0;
    const std::string refused = turnUp(rod, looks.back(), [&](double theta) {
      if (!isAt(looks, theta))
        return;
      const Halves h = rod.halves();
      if (edges == fine)
      {
        refined.push_back(h.share());
        return;
      }
      context.row()
          .set("shape", shape.name)
          .set("centreline", "free")
          .set("vertices", edges + 1)
          .set("turned_by_rad", theta)
          .set("quantity", "share of the turned half")
          .set("twist_turned", h.turned)
          .set("twist_clamped", h.clamped)
          .check(h.share(), refined.at(look++), 0.02, std::to_string(fine + 1) + " vertices");
      addProfile(profile, "turned by " + shortText(theta) + " rad", rod, edges);
      Series& s = picture.at("turned by " + shortText(theta) + " rad");
      for (int i = 0; i < rod.nodes().cols(); ++i)
      {
        s.x.push_back(rod.nodes()(0, i) + 0.5 * rod.nodes()(1, i));
        s.y.push_back(rod.nodes()(2, i) + 0.5 * rod.nodes()(1, i));
      }
    });
    if (!refused.empty())
      throw std::runtime_error(std::string(shape.name) + ", free: " + refused);
  }
}

}   // namespace

void runTwistAsymmetry(StudyContext& context)
{
  const std::vector<int> meshes = context.quick() ? std::vector<int>{48} : std::vector<int>{48, 96, 192};
  for (const RestShape& shape : kRestShapes)
  {
    holdCentreline(context, shape, meshes);
    freeCentreline(context, shape, context.quick() ? 96 : 192);

    // how far one can turn before a tenth of the twist is on the clamped side
    TurnedRod rod(shape, 48, true);
    double reach = 0;
    turnUp(rod, 20, [&](double theta) {
      reach = rod.halves().share() > 0.9 && reach > theta - 1.5 * kTurnStep ? theta : reach;
    });
    context.metric(std::string("turns_on_one_side_") + shape.name, reach / (2 * M_PI));
  }
  context.note(
      "Elliptic section 2 : 1 bent the easy way (B1 = 1, B2 = 4, C = 1.6/1.3, L = 1). V: a right angle in four edges "
      "of 48; n = 49 as in table 4.1.");
  context.note(
      "Held: every node pinned in place, so only frames move. Free: both ends clamped, one turned about its tangent.");
  context.note(
      "Within the last joint before a clamp the profile bends a little: the end correction gives that joint more "
      "length than the clamp.");
  context.note(
      "turns_on_one_side: applied turns (centreline held) up to which nine tenths of the twist stay on the turned "
      "side.");
}

const StudyRegistration kTwistAsymmetryRegistration{
    "twist_asymmetry", "a V and a semicircle turned at one end: where the twist goes", runTwistAsymmetry};

}   // namespace slender::study
