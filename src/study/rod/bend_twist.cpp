// Heavy, naturally curved rod hanging from a clamp: where its planar shape gives way to a three-dimensional one.
#include <algorithm>
#include <cmath>
#include <limits>
#include <iterator>
#include <string>

#include "bend_twist_table.h"
#include "study/framework/shape_cases.h"
#include "study/framework/cpu_clock.h"
#include "slender_sim/study/study.h"

namespace slender::study {
namespace {

constexpr double kFlat = 1e-3;   ///< out-of-plane extent over length below which a shape counts as planar
/// turn of a joint [rad] beyond which a mesh does not resolve the coils: 16 edges a turn
constexpr double kCoarse = 0.4;

/// Extent of the three-dimensional state next to the boundary, nu = 0.5 (bendtwist_amplitude.csv, good to about one
/// percent).
struct Extent
{
  double y, phi_over_pi, value;
};
constexpr Extent kExtents[] = {{0.5, 1.80, 0.1606},  {0.5, 1.84, 0.2745}, {0.5, 1.90, 0.3182}, {0.5, 2.10, 0.2542},
                               {0.3, 3.35, 0.06533}, {0.3, 3.50, 0.1320}, {0.4, 1.86, 0.1611}, {0.4, 1.95, 0.2646}};

/// EI = L = rho A = 1, so g = Gamma = (y phi)^3; the plane is x-z, the clamp looks down -z.
class HangingCurl
{
public:
  HangingCurl(double nu, int edges, bool matched = false) : nu_(nu), edges_(edges), matched_(matched) {}

  /// Starts from this planar shape: angle(s) from the downward vertical.
  template <class Angle>
  void start(double y, double phi, Angle angle)
  {
    build(y, phi);
    lay(rod_, planarNodes(angle), Eigen::Vector3d::UnitY());
    relaxPlanar();
  }

  /// Takes the planar equilibrium to other parameters, in moves of half a percent.
  void follow(double y, double phi)
  {
    const double y0 = y_, phi0 = phi_;
    const int moves =
        std::max(1, static_cast<int>(std::ceil(std::max(std::abs(phi / phi0 - 1), std::abs(y / y0 - 1)) / 0.005)));
    for (int k = 1; k <= moves; ++k)
    {
      const RodState last = rod_.state;
      build(y0 + (y - y0) * k / moves, phi0 + (phi - phi0) * k / moves);
      rod_.state.x = last.x;
      rod_.state.d1 = last.d1;
      rod_.state.twist = last.twist;
      rod_.state.grasps[0].section_twist[1] = last.grasps[0].section_twist[1];
      relaxPlanar();
    }
  }

  bool planarIsStable() const { return unstableModes(*rod_.model, rod_.state, rod_.inputs.gravity) == 0; }

  /// Largest distance from the plane [L] of the equilibrium that the rod itself goes to when pushed off the planar one.
  double extentWhenPushed(std::string& refused) const
  {
    RodSetup rod = rod_;
    pushOff(rod, Eigen::Vector3d::UnitY(), 0.5 * kFlat);
    RodStepper stepper(rod.model, timeConfig(Integrator::implicit_euler, 1.0, 1e-9));
    const StepReport report = stepper.solveEquilibrium(rod.state, rod.inputs);
    refused = report.ok ? (report.stable ? "" : "a saddle") : report.message;
    return refused.empty() ? rod.state.x.row(1).cwiseAbs().maxCoeff() : std::numeric_limits<double>::quiet_NaN();
  }

private:
  template <class Angle>
  Eigen::Matrix3Xd planarNodes(Angle angle) const
  {
    Eigen::Matrix3Xd nodes = Eigen::Matrix3Xd::Zero(3, edges_ + 1);
    for (int j = 0; j < edges_; ++j)
    {
      const double a = angle((j + 0.5) / edges_);
      nodes.col(j + 1) = nodes.col(j) + Eigen::Vector3d(std::sin(a), 0, -std::cos(a)) / edges_;
    }
    return nodes;
  }

  void build(double y, double phi)
  {
    y_ = y;
    phi_ = phi;
    const double gamma = std::pow(y * phi, 3);
    rod_ = naturalRod(sectionOf(1e5 * std::max(1.0, gamma), 1.0, 1.0, 1.0 / (1.0 + nu_)),
                      planarNodes([phi](double s) { return phi * s; }), Eigen::Vector3d::UnitY(),
                      {Curvature::tangent, matched_});
    rod_.inputs.gravity = {0, 0, -gamma};
    rod_.hold(0, 0, true);
    Eigen::Matrix3d down;   // columns t, d1, d2
    down << 0, 0, 1, 0, 1, 0, -1, 0, 0;
    rod_.state.grasps[0].X_WG.orientation = rod_.inputs.grasps[0].X_WG.orientation = Eigen::Quaterniond(down);
  }

  void relaxPlanar()
  {
    RodStepper stepper(keptPlanar(*rod_.model, 2), timeConfig(Integrator::implicit_euler, 1.0, 1e-9));
    require(stepper.solveEquilibrium(rod_.state, rod_.inputs), "planar equilibrium");
  }

  double nu_, y_ = 0, phi_ = 0;
  int edges_;
  bool matched_;
  RodSetup rod_;
};

/// Planar equilibrium of the continuous rod, theta'' = Gamma (1-s) sin(theta), integrated from its tip (theta' = phi
/// there).
std::vector<double> planarAngles(double gamma, double phi, double tip, int intervals)
{
  std::vector<double> angles(intervals + 1);
  double theta = tip, rate = phi;
  angles[intervals] = tip;
  const double h = -1.0 / intervals;
  for (int i = intervals; i > 0; --i)
  {
    const double s = static_cast<double>(i) / intervals;
    const auto bend = [&](double at, double th) { return gamma * (1 - at) * std::sin(th); };
    const double a1 = rate, b1 = bend(s, theta);
    const double a2 = rate + h / 2 * b1, b2 = bend(s + h / 2, theta + h / 2 * a1);
    const double a3 = rate + h / 2 * b2, b3 = bend(s + h / 2, theta + h / 2 * a2);
    const double a4 = rate + h * b3, b4 = bend(s + h, theta + h * a3);
    theta += h / 6 * (a1 + 2 * a2 + 2 * a3 + a4);
    rate += h / 6 * (b1 + 2 * b2 + 2 * b3 + b4);
    angles[i - 1] = theta;
  }
  return angles;
}

/// The boundary of the discrete rod at fixed y: bisection, 1e-6 of phi, of the planar state's stability. NaN: not
/// within 15 %.
double boundary(HangingCurl curl, const BendTwistPoint& p)
{
  curl.follow(p.y, p.phi);
  const bool stable = curl.planarIsStable();
  double inside = p.phi, outside = p.phi;
  while (curl.planarIsStable() == stable)
  {
    inside = outside;
    outside += (stable ? 0.01 : -0.01) * p.phi;
    if (std::abs(outside / p.phi - 1) > 0.15)
      return std::numeric_limits<double>::quiet_NaN();
    curl.follow(p.y, outside);
  }
  while (std::abs(outside - inside) > 1e-6 * p.phi)
  {
    const double middle = 0.5 * (inside + outside);
    curl.follow(p.y, middle);
    (curl.planarIsStable() == stable ? inside : outside) = middle;
  }
  return 0.5 * (inside + outside);
}

/// Counts wrong answers: on each side of the boundary by where the pushed rod goes, and by the planar state's
/// stability.
class Classifier
{
public:
  Classifier(Row& row, Plot& plot) : row_(row), plot_(plot) {}

  void at(HangingCurl& curl, const std::string& side, double y, double phi, bool planar)
  {
    curl.follow(y, phi);
    const bool stable = curl.planarIsStable();
    std::string refused;
    const double extent = curl.extentWhenPushed(refused);
    row_.set("planar_is_stable_" + side, stable ? "yes" : "no").set("extent_" + side, extent);
    if (!refused.empty())
      row_.set("refused", refused);
    wrong_ += (stable != planar) + !(planar ? extent < kFlat : extent > kFlat);   // a refusal, NaN, is wrong
    Series& s = plot_.at(std::isnan(extent) ? "no equilibrium" : extent > kFlat ? "three-dimensional" : "planar");
    s.points = true;
    s.x.push_back(phi / M_PI);
    s.y.push_back(y);
  }
  int wrong() const { return wrong_; }

private:
  Row& row_;
  Plot& plot_;
  int wrong_ = 0;
};

}   // namespace

void runBendTwist(StudyContext& context)
{
  const std::vector<int> meshes = context.quick() ? std::vector<int>{100} : std::vector<int>{100, 200};
  const int stride = context.quick() ? 8 : 1;
  std::vector<double> ratios;
  for (const BendTwistPoint& p : kBendTwistBoundary)
    if (ratios.empty() || ratios.back() != p.nu)
      ratios.push_back(p.nu);

  Plot& errors = context.plot("bend_twist_error", "Boundary of the planar state: error of the discrete rod",
                              "turn of a joint, phi / n [rad]", "relative error of phi");
  errors.lines = false;
  double worst_boundary = 0;
  int wrong = 0, coarse_wrong = 0, done = 0;
  const int total = static_cast<int>(std::size(kBendTwistBoundary) * meshes.size()) / stride;
  for (const double nu : ratios)
  {
    char name[32], title[64];
    std::snprintf(name, sizeof name, "bend_twist_nu_0%02.0f", 100 * nu);
    std::snprintf(title, sizeof title, "Hanging curl, nu = %g", nu);
    Plot& plot = context.plot(name, title, "phi / pi", "y = Gamma^(1/3) / phi");
    plot.log_x = plot.log_y = plot.markers = false;
    int index = 0;
    for (const BendTwistPoint& p : kBendTwistBoundary)
    {
      if (p.nu != nu)
        continue;
      plot.at("boundary, exact").x.push_back(p.phi / M_PI);
      plot.at("boundary, exact").y.push_back(p.y);
      if (index++ % stride)
        continue;
      const std::vector<double> angles = planarAngles(std::pow(p.y * p.phi, 3), p.phi, p.tip, 8000);
      for (const int edges : meshes)
      {
        context.progress(done++, total, title);
        const bool coarse = p.phi / edges > kCoarse;
        for (const bool matched : {false, true})
        {
          if (matched && !coarse)
            continue;
          const double begin = threadSeconds();
          HangingCurl curl(nu, edges, matched);
          curl.start(p.y, p.phi, [&](double s) { return angles[static_cast<std::size_t>(std::lround(8000 * s))]; });
          const double phi = boundary(curl, p);
          Row& row = context.row();
          row.set("moved", "phi").set("nu", nu).set("edges", edges).set("joints", matched ? "matched" : "plain");
          row.set("y", p.y).set("phi_over_pi", p.phi / M_PI);
          Classifier classes(row, plot);
          classes.at(curl, "below", p.y, 0.97 * p.phi, true);
          classes.at(curl, "above", p.y, 1.03 * p.phi, false);
          const double error = phi / p.phi - 1;
          row.set("boundary_error", error);
          if (matched || !coarse)
          {
            row.check(classes.wrong(), 0, 0.5, "wrong answers of 4, 3 % off the boundary");
            wrong += classes.wrong();
            worst_boundary = std::isnan(error) ? error : std::max(worst_boundary, std::abs(error));
          }
          else
          {
            row.set("measured", classes.wrong()).set("source", "too coarse for plain joints: under 16 edges a turn");
            coarse_wrong += classes.wrong();
          }
          row.set("cpu_seconds", threadSeconds() - begin);
          Series& line = errors.at(title + std::string(matched ? ", matched" : ""));
          line.x.push_back(p.phi / edges);
          line.y.push_back(std::abs(error));
        }
      }
    }
    for (auto p = std::rbegin(kBendTwistLongRods); p != std::rend(kBendTwistLongRods);
         ++p)   // listed from long to short
      if (p->nu == nu)
      {
        plot.at("boundary, exact").x.push_back(p->phi / M_PI);
        plot.at("boundary, exact").y.push_back(p->y);
      }
    for (const BendTwistPoint& p : kBendTwistLongRods)   // the boundary runs along phi here, so y is what is moved
      for (const int edges : meshes)
      {
        if (p.nu != nu)
          continue;
        const double begin = threadSeconds();
        HangingCurl curl(nu, edges);
        curl.start(1.03 * p.y, p.phi, [](double) { return 0.0; });
        Row& row = context.row();
        row.set("moved", "y").set("nu", nu).set("edges", edges).set("y", p.y).set("phi_over_pi", p.phi / M_PI);
        Classifier classes(row, plot);
        classes.at(curl, "above", 1.03 * p.y, p.phi, true);
        classes.at(curl, "below", 0.97 * p.y, p.phi, false);
        row.check(classes.wrong(), 0, 0.5, "wrong answers of 4, 3 % off the boundary")
            .set("cpu_seconds", threadSeconds() - begin);
        wrong += classes.wrong();
      }
  }
  for (const Extent& e : kExtents)
    for (const int edges : meshes)
    {
      // along the planar branch from where phi is small
      HangingCurl curl(0.5, edges);
      curl.start(e.y, 1.0, [](double s) { return s; });
      curl.follow(e.y, e.phi_over_pi * M_PI);
      std::string refused;
      const double extent = curl.extentWhenPushed(refused);
      Row& row = context.row();
      row.set("moved", "-").set("nu", 0.5).set("edges", edges).set("y", e.y).set("phi_over_pi", e.phi_over_pi);
      row.check(extent, e.value, 0.03 * e.value, "bendtwist_amplitude: extent over L of the three-dimensional state");
    }
  context.metric("wrong_classes", wrong);
  context.metric("wrong_classes_coarse", coarse_wrong);
  context.metric("worst_boundary_error", worst_boundary);
  context.note(
      "Each state is classified twice: by the out-of-plane extent (over L) of the equilibrium that a rod pushed off "
      "the plane by "
      "5e-4 L goes to,");
  context.note(
      "and by the inertia of the Hessian at the planar equilibrium. boundary_error: where the latter changes, by "
      "bisection in phi at fixed y.");
  context.note(
      "A plain joint that turns by a is (1 + a^2/2) times too stiff. Where a > 0.4 rad (under 16 edges a turn; n = 100 "
      "beyond 6 turns) it is");
  context.note(
      "shown without a check (wrong_classes_coarse), and joints matched to their natural turn, which suit such coils, "
      "are checked.");
}

const StudyRegistration kBendTwistRegistration{
    "bend_twist", "heavy naturally curved rod: planar or three-dimensional on both sides of the boundary",
    runBendTwist};

}   // namespace slender::study
