// Buckling of a straight rod under torque and tension, clamped or pinned at both ends (Greenhill).
#include <cmath>
#include <complex>
#include <iterator>
#include <limits>

#include <Eigen/Dense>

#include "study/framework/shape_cases.h"
#include "slender_sim/rod/rod_system.h"
#include "slender_sim/study/study.h"

namespace slender::study {
namespace {

/// greenhill.csv: tension T L^2/B and the torque M L/B at which a rod with clamped ends buckles.
struct TorqueThreshold
{
  double tension, torque;
};
constexpr TorqueThreshold kTorqueThresholds[] = {{-30, 3.800429623}, {-20, 5.771135703}, {-10, 7.451015644},
                                                 {-5, 8.232810781},  {0, 8.986818916},   {1, 9.134730089},
                                                 {5, 9.717747733},   {10, 10.42885644},  {20, 11.80032954},
                                                 {50, 15.58932393},  {100, 20.98350083}, {200, 28.98273785}};
constexpr double kShaftStretch = 1e7;
/// the threshold does not depend on it, but joints that twist far do: the mean of both edges' curvatures (3.14) is
/// cos(m/2) of either, m the joint's twist
constexpr double kShaftTwist = 2.0;
constexpr double kSoftTwist = 1 / 1.3;

/// B = L = 1. One clamp is free to slide in the reference; for small deflections sliding does not matter.
bool isStable(int edges, double twist, Curvature curvature, double tension, double torque)
{
  RodCase rod_case;
  rod_case.edges = edges;
  rod_case.stretch = kShaftStretch;
  rod_case.twist = twist;
  RodSetup rod = straightRod(rod_case, torque / twist);
  auto model = std::make_shared<RodModel>(*rod.model);
  model->curvature = curvature;   // of a straight rod, whose rest curvatures are zero either way
  rod.model = model;
  rod.state.x *= 1.0 + tension / kShaftStretch;
  rod.hold(0, 0, true);
  rod.hold(edges, edges, true);
  // a straight rod stays straight: only its frames look for their equilibrium
  RodSystem system(*rod.model);
  system.load(rod.state);
  system.setResponse(0.0, nullptr);
  std::vector<Pose> poses;
  for (const GraspState& g : rod.state.grasps)
    poses.push_back(g.X_WG);
  for (int i = 0; i <= edges; ++i)
    system.setInertia(i, 0.0, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero());
  system.placeGrasps(poses);
  system.relaxFrames();
  system.store(rod.state);
  return unstableModes(*rod.model, rod.state, Eigen::Vector3d::Zero()) == 0;
}

double threshold(int edges, double twist, const TorqueThreshold& t, Curvature curvature = Curvature::tangent)
{
  double stable = 0.3 * t.torque, unstable = 1.7 * t.torque;
  for (int i = 0; i < 40; ++i)
  {
    const double middle = 0.5 * (stable + unstable);
    (isStable(edges, twist, curvature, t.tension, middle) ? stable : unstable) = middle;
  }
  return 0.5 * (stable + unstable);
}

constexpr TorqueThreshold kPinned[] = {{-5, 4.413436032}, {0, 6.283185307},   {1, 6.593816619},
                                       {5, 7.712225204},  {10, 8.915066887},  {20, 10.93061835},
                                       {50, 15.47509023}, {100, 20.96374054}, {200, 28.97375394}};

/// Pinned ends whose torque keeps its direction have no potential (a grasp cannot be that): equilibrium in the rod's
/// forces and the couples M (e_x x t) that the torque puts on the end edges. Linear in small deflections w = y + i z of
/// the inner nodes; A w are the forces.
Eigen::MatrixXcd pinnedStiffness(int edges, double tension, double torque)
{
  constexpr double kStiffTwist = 100.0, kPush = 1e-6;
  RodCase rod_case;
  rod_case.edges = edges;
  rod_case.twist = kStiffTwist;
  // the ends are free, so that the twist lies in the joints between the edges' middles
  RodSetup rod = straightRod(rod_case, torque / kStiffTwist * (edges - 1) / edges);
  RodSystem system(*rod.model);
  system.load(rod.state);
  system.leaveOutStretching(true);   // its tension is given
  system.setResponse(0.0, nullptr);
  for (int i = 0; i <= edges; ++i)
    system.setInertia(i, 0.0, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero());
  Eigen::MatrixXcd a(edges - 1, edges - 1);
  for (int j = 1; j < edges; ++j)
  {
    const Eigen::Vector3d place = system.position(j);
    system.setPosition(j, place + Eigen::Vector3d(0, kPush, 0));
    system.evaluateWhole(false);
    // frames follow without turning about the tangents, which changes the joints' twists by small quantities of second
    // order only
    const auto edge = [&](int from) { return Eigen::Vector3d(system.position(from + 1) - system.position(from)); };
    const auto couple = [&](int from) {
      return Eigen::Vector3d(torque * Eigen::Vector3d::UnitX().cross(edge(from)) / edge(from).squaredNorm());
    };
    const Eigen::Vector3d first = couple(0), last = couple(edges - 1);
    for (int i = 1; i < edges; ++i)
    {
      Eigen::Vector3d force = -Eigen::Map<const Eigen::Vector3d>(system.gradient() + 4 * i);
      force += tension * (edge(i).normalized() - edge(i - 1).normalized());
      if (i == 1)
        force -= first;
      if (i == edges - 1)
        force -= last;
      a(i - 1, j - 1) = std::complex<double>(force.y(), force.z()) / kPush;
    }
    system.setPosition(j, place);
  }
  return a;
}

/// The least torque beyond half of `guess` at which a deflection needs no force.
double pinnedThreshold(int edges, double tension, double guess)
{
  double torque = guess;
  for (int k = 0; k < 3; ++k)   // A is very nearly linear in the torque
  {
    const double d = 0.01 * guess;
    const Eigen::MatrixXcd high = pinnedStiffness(edges, tension, torque + d),
                           low = pinnedStiffness(edges, tension, torque - d);
    const Eigen::MatrixXcd slope = (high - low) / (2 * d), rest = 0.5 * (high + low) - torque * slope;
    // (rest + M slope) w = 0
    const Eigen::VectorXcd inverse =
        Eigen::ComplexEigenSolver<Eigen::MatrixXcd>(rest.partialPivLu().solve(slope), false).eigenvalues();
    double least = std::numeric_limits<double>::infinity();
    for (const std::complex<double>& v : inverse)
      if (const std::complex<double> m = -1.0 / v; std::abs(m.imag()) < 1e-3 * std::abs(m) && m.real() > 0.5 * guess)
        least = std::min(least, m.real());
    torque = least;
  }
  return torque;
}

void addPinned(StudyContext& context)
{
  for (const int edges : context.quick() ? std::vector<int>{100} : std::vector<int>{50, 100})
    for (const TorqueThreshold& t : kPinned)
    {
      context.progress(0, 1, "pinned, n = " + std::to_string(edges));
      const double torque = pinnedThreshold(edges, t.tension, 0.8 * t.torque);
      Row& row = context.row();
      row.set("n", edges)
          .set("TL2_over_B", t.tension)
          .set("ends", "pinned")
          .set("relative_error", torque / t.torque - 1);
      if (edges >= 100)
        row.check(torque, t.torque, 0.01 * t.torque, "greenhill.csv, pinned, torque along the axis");
    }
}

}   // namespace

void runGreenhill(StudyContext& context)
{
  Plot& plot = context.plot("greenhill", "Torque that buckles a clamped rod under tension", "T L^2 / B", "M L / B");
  plot.log_x = plot.log_y = false;
  const std::vector<int> meshes = context.quick() ? std::vector<int>{100} : std::vector<int>{50, 100, 200};
  int done = 0;
  double coarse = 0, fine = 0;
  for (const int edges : meshes)
    for (const TorqueThreshold& t : kTorqueThresholds)
    {
      context.progress(done++, static_cast<int>(meshes.size() * std::size(kTorqueThresholds)),
                       "n = " + std::to_string(edges));
      const double torque = threshold(edges, kShaftTwist, t);
      Row& row = context.row();
      row.set("n", edges).set("TL2_over_B", t.tension).set("relative_error", torque / t.torque - 1);
      if (edges >= 100)
        row.check(torque, t.torque, 0.01 * t.torque, "greenhill.csv, clamped");
      if (t.tension == 0 && edges != 100)
        (edges == 50 ? coarse : fine) = std::abs(torque - t.torque);
      plot.at("n = " + std::to_string(edges)).x.push_back(t.tension);
      plot.at("n = " + std::to_string(edges)).y.push_back(torque);
      if (edges == meshes.front())
      {
        plot.at("exact").x.push_back(t.tension);
        plot.at("exact").y.push_back(t.torque);
      }
    }
  for (const TorqueThreshold& t : kTorqueThresholds)
  {
    context.row()
        .set("n", 100)
        .set("TL2_over_B", t.tension)
        .set("beta_over_B", kSoftTwist)
        .set("relative_error", threshold(100, kSoftTwist, t) / t.torque - 1);
    const double torque = threshold(100, kSoftTwist, t, Curvature::compensated);
    Row& row = context.row();
    row.set("n", 100)
        .set("TL2_over_B", t.tension)
        .set("beta_over_B", kSoftTwist)
        .set("curvature", "compensated")
        .set("relative_error", torque / t.torque - 1);
    row.check(torque, t.torque, 0.001 * t.torque, "greenhill.csv, clamped");
  }
  addPinned(context);
  if (!context.quick())
    context.metric("observed_order", 0.5 * observedOrder(coarse, fine));   // over a factor of four in n
  context.note(
      "Rows with beta_over_B = 0.77: joints twist by up to 0.38 rad, which softens their bending by cos^2(m/2); shown, "
      "not checked.");
  context.note("Compensated joints do not feel it, and are checked to 0.1 %.");
  context.note(
      "Pinned: a torque that keeps its direction has no potential, so no grasp offers it; the rod's forces and that "
      "torque's couples balance.");
}

const StudyRegistration kGreenhillRegistration{
    "greenhill", "torque that buckles a clamped straight rod under tension or compression", runGreenhill};

}   // namespace slender::study
