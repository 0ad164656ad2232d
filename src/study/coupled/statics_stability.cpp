// Statics from states that are exactly symmetric, on both sides of the loads at which they lose their stability: it
// must stay where the state is stable, leave it where it is not, and never call an unstable end stable.
#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <limits>
#include <string>

#include <Eigen/Eigenvalues>

#include "study/rod/bend_twist_table.h"
#include "study/framework/shape_cases.h"
#include "statics_plates.h"
#include "slender_sim/geometry/curves.h"
#include "slender_sim/rod/rod_system.h"
#include "slender_sim/study/study.h"

namespace slender::study {
namespace {

constexpr double kPi = M_PI;

/// A rod on the branch in question, and what is known of it.
struct StaticsCase
{
  std::string family, label;
  int edges = 0;
  double factor = 1.0;   ///< over the threshold of the continuous rod
  /// |factor - 1| beyond which the continuous threshold decides; nearer to it the mesh's own Hessian does
  double trusted = 0.02;
  RodSetup rod;   ///< in equilibrium on the branch, exactly symmetric
  /// [1/s^2] eigenvalues of rigid motions, which cost nothing, are this far from negative ones; 0: there are none
  double ground = 0.0;
  std::function<double(const RodState&)> away;   ///< distance from the branch over the length
};

/// Where rigid motions cost nothing, eigenvalues of this size [1/s^2] are nothing but their round-off, of a rod with B
/// = rho A = 1: a share of the lowest bending mode, 12 / L^4, and rounding errors of the stretching entries over the
/// masses.
double groundOf(double stretch, double length, int edges)
{
  return 1e-3 / std::pow(length, 4) +
         8 * std::numeric_limits<double>::epsilon() * 4 * stretch * std::pow(edges / length, 2);
}

/// Number of negative eigenvalues of K + ground M, by the rod's own matrix. Shares no line with the statics' search.
int negativeRodModes(const RodSetup& rod, double ground)
{
  RodSystem system(*rod.model);
  system.load(rod.state);
  system.setResponse(0.0, nullptr);
  std::vector<Pose> poses;
  for (const GraspState& g : rod.state.grasps)
    poses.push_back(g.X_WG);
  system.placeGrasps(poses);
  for (int i = 0; i < rod.model->nodes(); ++i)   // dead loads do not change the second derivative
    system.setInertia(i, ground * rod.model->mass[i], system.position(i), Eigen::Vector3d::Zero());
  const Inertia inertia = system.evaluate(true).inertia;
  return inertia.negative + inertia.zero;
}

/// `shape`: a number for the column `localisation`, of the end where the rod left its branch.
void judgeRod(StudyContext& context, const StaticsCase& c, StaticsTally& tally,
              const std::function<double(const RodState&)>& shape = nullptr)
{
  const int before = negativeRodModes(c.rod, c.ground);
  const bool near = std::abs(c.factor - 1) <= c.trusted;
  const bool leaves = near ? before > 0 : c.factor > 1;
  RodSetup rod = c.rod;
  RodStepper stepper(rod.model, timeConfig(Integrator::implicit_euler, 1.0, 1e-9));
  const StepReport report = stepper.solveEquilibrium(rod.state, rod.inputs);
  const double away = report.ok ? c.away(rod.state) : 0.0;
  const int after = report.ok ? negativeRodModes(rod, c.ground) : 0;
  const bool refused = !report.ok, wrong = refused || (leaves && (away < kAwayFromBranch || after > 0)) ||
                                           (!leaves && away > kAwayFromBranch);
  const bool called_stable = report.ok && report.stable && after > 0;
  ++tally.cases;
  tally.wrong += wrong;
  tally.refused += refused;
  tally.called_stable += called_stable;
  tally.unstable_ends += report.ok && !report.stable;
  tally.worst_residual = std::max(tally.worst_residual, report.ok ? report.residual : 0.0);
  Row& row = context.row();
  row.set("family", c.family)
      .set("case", c.label)
      .set("edges", c.edges)
      .set("factor", c.factor)
      .set("decided_by", near ? "mesh" : "reference");
  row.set("unstable_modes_of_branch", before)
      .set("unstable_modes_of_end", after)
      .set("distance", away)
      .set("lowest_eigenvalue", report.lowest_eigenvalue);
  row.set("stable", report.stable ? "yes" : "no").set("saddles_left", report.escapes).set("energy", report.energy);
  if (refused)
    row.set("refused", report.message);
  if (shape && away > kAwayFromBranch)
    row.set("localisation", shape(rod.state));
  row.check(wrong + called_stable, 0, 0.5,
            leaves ? "must leave the branch for a stable state" : "must stay on the branch");
}

/// Solves for the equilibrium within the plane, by a rod that is too stiff across it.
void relaxPlanar(RodSetup& rod, int keep)
{
  RodStepper stepper(keptPlanar(*rod.model, keep), timeConfig(Integrator::implicit_euler, 1.0, 1e-9));
  require(stepper.solveEquilibrium(rod.state, rod.inputs), "planar equilibrium");
}

double acrossPlane(const RodState& s) { return s.x.row(1).cwiseAbs().maxCoeff(); }

/// Heavy cantilevers of elliptical section (lateral_rod_ellipse.csv); A1 = L = rho A = 1.
void addLateral(StudyContext& context, StaticsTally& tally, const std::vector<int>& meshes)
{
  struct Section
  {
    double nu, a_over_b, gamma;
  };
  constexpr Section kSections[] = {
      {0.3, 3, 53.415613}, {0.5, 2.5, 0}, {0.3, 5, 65.114802}, {0.3, 10, 118.00056}, {0.5, 20, 201.10635}};
  for (const Section& s : kSections)
    for (const int edges : meshes)
      for (const double factor : {0.97, 1.02, 1.2, 1.5})
      {
        // a/b = 2.5 is not in the table: there the mesh decides
        const double gamma = s.gamma > 0 ? s.gamma : 54.0, r2 = s.a_over_b * s.a_over_b;
        const Eigen::Matrix3Xd nodes = straightCurve({0, 0, 0}, {1, 0, 0}, edges, 5.0);
        StaticsCase c;
        c.family = "lateral";
        c.label = "nu " + std::to_string(s.nu).substr(0, 4) + ", a/b " + std::to_string(s.a_over_b).substr(0, 4);
        c.edges = edges;
        c.factor = factor;
        c.trusted = s.gamma > 0 ? 0.01 + 60.0 / (edges * edges) : 1e9;
        c.rod = naturalRod(sectionOf(1e5 * std::max(100.0, 2 * gamma), r2, 1.0, 0.5 * (1 + r2) / (1 + s.nu)), nodes,
                           Eigen::Vector3d::UnitZ());
        c.rod.hold(0, 0, true);
        c.rod.inputs.gravity = {0, 0, -factor * gamma};
        if (factor != 1.2)   // at 1.2 the start is the straight rod itself
          relaxPlanar(c.rod, 1);
        else
        {
          RodSetup planar = c.rod;
          relaxPlanar(planar, 1);
          // the branch that decides is the bent one; the search starts from the straight rod
          if (c.trusted > 1 && negativeRodModes(planar, 0.0) == 0)
            continue;
          c.trusted = std::min(c.trusted, 0.1);
        }
        c.away = acrossPlane;
        context.progress(tally.cases, 0, c.family + " " + c.label);
        judgeRod(context, c, tally);
      }
}

/// Heavy, naturally curved rods that hang from a clamp (bendtwist_boundary.csv); EI = L = rho A = 1, the plane is x-z.
class Curl
{
public:
  Curl(const BendTwistPoint& p, int edges) : p_(p), edges_(edges)
  {
    build(p.phi);
    double theta = p.tip, rate = p.phi;
    std::vector<double> angles(edges);
    const int fine = std::max(1, 8000 / edges), steps = fine * edges;
    const double h = -1.0 / steps, gamma = std::pow(p.y * p.phi, 3);
    for (int i = steps; i > 0; --i)   // theta'' = Gamma (1 - s) sin(theta) from the tip, midpoint rule
    {
      const double s = static_cast<double>(i) / steps, middle = theta + h / 2 * rate;
      const double middle_rate = rate + h / 2 * gamma * (1 - s) * std::sin(theta);
      theta += h * middle_rate;
      rate += h * gamma * (1 - s - h / 2) * std::sin(middle);
      if ((i - 1) % fine == fine / 2)
        angles[(i - 1) / fine] = theta;
    }
    lay(rod_, nodes([&](int j) { return angles[j]; }), Eigen::Vector3d::UnitY());
    relaxPlanar(rod_, 2);
  }

  /// Takes the planar equilibrium to another natural curvature at the same y, in moves of half a percent.
  void follow(double phi)
  {
    const double from = phi_;
    const int moves = std::max(1, static_cast<int>(std::ceil(std::abs(phi / from - 1) / 0.005)));
    for (int k = 1; k <= moves; ++k)
    {
      const RodState last = rod_.state;
      build(from + (phi - from) * k / moves);
      rod_.state.x = last.x;
      rod_.state.d1 = last.d1;
      rod_.state.twist = last.twist;
      rod_.state.grasps[0].section_twist[1] = last.grasps[0].section_twist[1];
      relaxPlanar(rod_, 2);
    }
  }
  const RodSetup& rod() const { return rod_; }

private:
  template <class Angle>
  Eigen::Matrix3Xd nodes(Angle angle) const
  {
    Eigen::Matrix3Xd x = Eigen::Matrix3Xd::Zero(3, edges_ + 1);
    for (int j = 0; j < edges_; ++j)
      x.col(j + 1) = x.col(j) + Eigen::Vector3d(std::sin(angle(j)), 0, -std::cos(angle(j))) / edges_;
    return x;
  }

  void build(double phi)
  {
    phi_ = phi;
    const double gamma = std::pow(p_.y * phi, 3);
    rod_ = naturalRod(sectionOf(1e5 * std::max(1.0, gamma), 1.0, 1.0, 1.0 / (1.0 + p_.nu)),
                      nodes([&](int j) { return phi * (j + 0.5) / edges_; }), Eigen::Vector3d::UnitY());
    rod_.inputs.gravity = {0, 0, -gamma};
    rod_.hold(0, 0, true);
    Eigen::Matrix3d down;   // columns t, d1, d2
    down << 0, 0, 1, 0, 1, 0, -1, 0, 0;
    rod_.state.grasps[0].X_WG.orientation = rod_.inputs.grasps[0].X_WG.orientation = Eigen::Quaterniond(down);
  }

  BendTwistPoint p_;
  int edges_;
  double phi_ = 0;
  RodSetup rod_;
};

void addBendTwist(StudyContext& context, StaticsTally& tally, const std::vector<int>& meshes)
{
  for (const BendTwistPoint& p : kBendTwistBoundary)
  {
    const bool wanted =
        (p.nu == 0.5 || p.nu == 0.4 || p.nu == 0.3) && (p.y == 0.2 || p.y == 0.3 || p.y == 0.4 || p.y == 0.5);
    for (const int edges : meshes)
    {
      if (!wanted || p.phi / edges > 0.4)   // the mesh must resolve the coils: 16 edges a turn
        continue;
      Curl curl(p, edges);
      for (const double factor : {0.97, 1.01, 1.02, 1.03})
      {
        curl.follow(factor * p.phi);
        StaticsCase c;
        c.family = "bend_twist";
        c.label = "nu " + std::to_string(p.nu).substr(0, 4) + ", y " + std::to_string(p.y).substr(0, 3);
        c.edges = edges;
        c.factor = factor;
        // the boundary's error is of second order in the turn of a joint
        c.trusted = 0.005 + 0.4 * std::pow(p.phi / edges, 2);
        c.rod = curl.rod();
        c.away = acrossPlane;
        context.progress(tally.cases, 0, c.family + " " + c.label);
        judgeRod(context, c, tally);
      }
    }
  }
}

double acrossAxis(const RodState& s) { return s.x.bottomRows(2).colwise().norm().maxCoeff(); }

/// Tension T of a straight rod of stiffness EA = `stretch` whose threshold is that of an inextensible rod under the
/// tension `effective`. An edge of length 1 + T/EA that turns by the angle t adds T (1 + T/EA) t^2 / 2 to the second
/// derivative, in place of T t^2 / 2.
double tensionOf(double effective, double stretch)
{
  return 0.5 * stretch * (std::sqrt(1.0 + 4.0 * effective / stretch) - 1.0);
}

/// A clamped rod under torque and tension (greenhill.csv, column clamped: w'''' - i M w''' - T w'' = 0 with w = w' = 0
/// at both ends). B = L = rho A = 1.
struct TwistedRod
{
  const char* family;
  double tension, torque;   ///< at the threshold
  double stretch;           ///< E A
  double error;             ///< largest relative error of a mesh's threshold, times the square of its number of edges
};

/// The straight rod with `factor` times the torque of the threshold.
StaticsCase twistedRod(const TwistedRod& rod, int edges, double factor)
{
  RodCase rod_case;
  rod_case.edges = edges;
  rod_case.stretch = rod.stretch;
  rod_case.twist = 2.0;   // joints that twist far soften their bending, see study greenhill
  StaticsCase c;
  c.family = rod.family;
  c.label = "T L^2/B " + std::to_string(static_cast<int>(rod.tension));
  c.edges = edges;
  c.factor = factor;
  c.trusted = 0.01 + rod.error / (edges * edges);
  c.rod = straightRod(rod_case, factor * rod.torque / rod_case.twist);
  c.rod.state.x *= 1.0 + tensionOf(rod.tension, rod.stretch) / rod.stretch;
  c.rod.hold(0, 0, true);
  c.rod.hold(edges, edges, true);
  // A straight rod stays straight: only its frames look for their equilibrium.
  RodSystem system(*c.rod.model);
  system.load(c.rod.state);
  system.setResponse(0.0, nullptr);
  for (int i = 0; i <= edges; ++i)
    system.setInertia(i, 0.0, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero());
  system.relaxFrames();
  system.store(c.rod.state);
  c.ground = groundOf(rod.stretch, 1.0, edges);   // what has buckled can turn about the axis
  c.away = acrossAxis;
  return c;
}

/// Straight clamped rods, which become helices.
void addHelices(StudyContext& context, StaticsTally& tally, const std::vector<int>& meshes)
{
  constexpr TwistedRod kRods[] = {{"helix", -20, 5.771135703, 1e6, 40},
                                  {"helix", 0, 8.986818916, 1e6, 40},
                                  {"helix", 20, 11.80032954, 1e6, 40},
                                  {"helix", 100, 20.98350083, 1e6, 40}};
  for (const TwistedRod& rod : kRods)
    for (const int edges : meshes)
      for (const double factor : {0.95, 1.05, 1.2})
      {
        const StaticsCase c = twistedRod(rod, edges, factor);
        context.progress(tally.cases, 0, c.family + " " + c.label);
        judgeRod(context, c, tally);
      }
}

/// Largest angle between the rod and its axis over the root of its mean square: 1.4 for a helix along the whole rod,
/// whose envelope is a sine.
double localisation(const RodState& s)
{
  double largest = 0.0, sum = 0.0;
  const Eigen::Index edges = s.x.cols() - 1;
  for (Eigen::Index j = 0; j < edges; ++j)
  {
    const double angle = std::acos(std::clamp((s.x.col(j + 1) - s.x.col(j)).normalized().x(), -1.0, 1.0));
    largest = std::max(largest, angle);
    sum += angle * angle / static_cast<double>(edges);
  }
  return largest / std::sqrt(std::max(sum, 1e-300));
}

/// Long rods, whose thresholds are within 1.1 % of M^2 = 4 B T of the infinite rod. They are so extensible that
/// buckling takes much length out of them, and then the helix is localised (Coyne 1990, van der Heijden and Thompson
/// 2000).
void addLocalisedHelices(StudyContext& context, StaticsTally& tally, const std::vector<int>& meshes)
{
  constexpr TwistedRod kRods[] = {{"localised_helix", 500, 45.16117543, 2e3, 600},
                                  {"localised_helix", 1000, 63.55930846, 5e3, 600}};
  for (const TwistedRod& rod : kRods)
    for (const int edges : meshes)
      for (const double factor : {0.97, 1.03, 1.1, 1.15})
      {
        if (edges < 80)   // a turn of the helix needs at least eight edges
          continue;
        StaticsCase c = twistedRod(rod, edges, factor);
        // Well beyond the threshold a rod without contact may pass through itself and become straight again, with less
        // twist.
        const double twist = c.rod.state.twist.sum();
        c.away = [twist](const RodState& s) { return std::max(acrossAxis(s), std::abs(s.twist.sum() - twist)); };
        context.progress(tally.cases, 0, c.family + " " + c.label);
        judgeRod(context, c, tally, localisation);
      }
}

/// Twisted rings (Michell, Zajac) of radius 1 and bending modulus 1, free in space: the twist is a rest twist of the
/// opposite sign.
void addRings(StudyContext& context, StaticsTally& tally, const std::vector<int>& meshes)
{
  for (const double beta : {0.6, 0.77, 1.5})
    for (const int edges : meshes)
      for (const double factor : {0.95, 1.05, 1.3})
      {
        Eigen::Matrix3Xd nodes(3, edges);
        for (int i = 0; i < edges; ++i)
          nodes.col(i) << std::cos(2 * kPi * i / edges), std::sin(2 * kPi * i / edges), 0.0;
        RodModel model = buildRod("ring", nodes, true, std::vector<RodSection>(edges, sectionOf(1e6, 1.0, 1.0, beta)),
                                  Eigen::Vector3d::UnitZ(), true);
        StaticsCase c;
        c.rod.state = makeRodState(model, nodes, Eigen::Vector3d::UnitZ());
        model.rest_twist.setConstant(-factor * 2 * kPi * std::sqrt(3.0) / beta / edges);
        c.rod.model = std::make_shared<const RodModel>(std::move(model));
        c.rod.inputs.gravity.setZero();
        c.family = "ring";
        c.label = "beta/alpha " + std::to_string(beta).substr(0, 4);
        c.edges = edges;
        c.factor = factor;
        c.trusted = 0.005 + 35.0 / (edges * edges);   // the n-gon's threshold is high by 31.3/n^2
        c.ground = groundOf(1e6, 2 * kPi, edges);
        // The square of the extent across the plane, or how much twist has gone: a ring that passes through itself may
        // become a circle again.
        c.away = [](const RodState& s) {
          const Eigen::Matrix3Xd x = s.x.colwise() - s.x.rowwise().mean();
          const double across =
              Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(x * x.transpose() / x.cols()).eigenvalues()[0];
          return std::max(across, std::abs(s.twist.sum()));
        };
        context.progress(tally.cases, 0, c.family + " " + c.label);
        judgeRod(context, c, tally);
      }
}

/// Columns: pushed together between clamps (Euler), under a dead load at the tip (Euler), under their own weight
/// (Greenhill: 7.8373 B/L^3).
void addColumns(StudyContext& context, StaticsTally& tally, const std::vector<int>& meshes)
{
  constexpr double kStretch = 1e5;
  for (const int kind : {0, 1, 2})
    for (const int edges : meshes)
      for (const double factor : {0.95, 1.03, 1.2})
      {
        RodCase rod_case;
        rod_case.edges = edges;
        rod_case.stretch = kStretch;
        const char* const labels[] = {"clamps pushed together", "dead load at the tip", "own weight"};
        const double critical[] = {4 * kPi * kPi, kPi * kPi / 4, 7.8373};
        StaticsCase c;
        c.family = "column";
        c.label = labels[kind];
        c.edges = edges;
        c.factor = factor;
        c.trusted = 0.005 + 30.0 / (edges * edges);
        c.rod = straightRod(rod_case);
        const double load = factor * critical[kind];
        if (kind == 0)
          c.rod.state.x *= 1.0 - load / kStretch;
        c.rod.hold(0, 0, true);
        if (kind == 0)
          c.rod.hold(edges, edges, true);
        else if (kind == 1)
        {
          c.rod.inputs.forces = Eigen::Matrix3Xd::Zero(3, edges + 1);
          c.rod.inputs.forces(0, edges) = -load;
        }
        else
          c.rod.inputs.gravity = {-load, 0, 0};
        c.ground = groundOf(kStretch, 1.0, edges);
        c.away = acrossAxis;
        if (kind > 0)
        {
          // compressed, but straight: by a rod too stiff to bend
          auto stiff = std::make_shared<RodModel>(*c.rod.model);
          stiff->bend_modulus *= 1e3;
          RodStepper stepper(stiff, timeConfig(Integrator::implicit_euler, 1.0, 1e-9));
          require(stepper.solveEquilibrium(c.rod.state, c.rod.inputs), "straight column");
        }
        context.progress(tally.cases, 0, c.family + " " + c.label);
        judgeRod(context, c, tally);
      }
}

}   // namespace

void runStaticsStability(StudyContext& context)
{
  const std::vector<int> meshes =
      context.quick() ? std::vector<int>{20, 80} : std::vector<int>{20, 40, 80, 160, 320, 640, 1280};
  StaticsTally tally;
  addLateral(context, tally, meshes);
  addBendTwist(context, tally, meshes);
  addHelices(context, tally, meshes);
  addLocalisedHelices(context, tally, meshes);
  addRings(context, tally, meshes);
  addColumns(context, tally, meshes);
  addPlates(context, tally);
  context.metric("cases", tally.cases);
  context.metric("wrong_equilibria", tally.wrong);
  context.metric("unstable_reported_as_stable", tally.called_stable);
  context.metric("refused", tally.refused);
  context.metric("reported_unstable", tally.unstable_ends);
  context.metric("worst_residual", tally.worst_residual);
  context.note(
      "Each case starts exactly on the branch (planar, straight or circular). Within `trusted` of the continuous "
      "threshold the inertia of the "
      "mesh's own Hessian decides which answer is right, beyond it the reference does.");
  context.note(
      "Localised helices: long rods under tension. `localisation` is the largest angle to the axis over the root of "
      "its mean square: 1.4 for a sine "
      "along the whole rod, more for a helix that is localised, 0 for a rod that passed through itself and is straight "
      "again.");
  context.note(
      "Plates: `edges` are cells along the plate, `factor` is over the threshold of plate theory. The loads are 0.97, "
      "1.03 and 1.2 times the threshold of the "
      "same mesh, which the inertia of its Hessian gives.");
}

const StudyRegistration kStaticsStabilityRegistration{
    "statics_stability",
    "statics from exactly symmetric states around thresholds: never an unstable equilibrium called stable",
    runStaticsStability};

}   // namespace slender::study
