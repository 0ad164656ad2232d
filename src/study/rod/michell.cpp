// Michell's (Zajac's) instability: the twist at which a ring of a naturally straight isotropic rod leaves its plane
// (thesis 4.7.1, Fig. 4.4).
#include <cmath>
#include <string>

#include <Eigen/Eigenvalues>

#include "rod_cases.h"
#include "slender_sim/rod/isotropic_rod.h"
#include "slender_sim/rod/rod_system.h"
#include "slender_sim/study/study.h"

namespace slender::study {
namespace {

/// Ring of radius 1 with bending modulus 1. The imposed twist is a rest twist of the opposite sign: a closed rod turned
/// by any angle before its ends were joined.
class Ring
{
public:
  Ring(int edges, double beta, Curvature curvature) : edges_(edges)
  {
    Eigen::Matrix3Xd nodes(3, edges);
    const double radius = 1.0;
    for (int i = 0; i < edges; ++i)
      nodes.col(i) = radius * Eigen::Vector3d(std::cos(2 * M_PI * i / edges), std::sin(2 * M_PI * i / edges), 0);
    const RodSection section{0.01, 0.01, 1.0, 1e6, Eigen::Matrix2d::Identity(), beta};
    model_ = buildRod("ring", nodes, true, std::vector<RodSection>(edges, section), Eigen::Vector3d::UnitZ(), true,
                      {curvature, false});
    state_ = makeRodState(model_, nodes, Eigen::Vector3d::UnitZ());
  }

  void twist(double angle) { model_.rest_twist.setConstant(-angle / edges_); }

  /// Whether the energy has a minimum in the plane. A millionth of the bending stiffness on all nodes decides the rigid
  /// motions, which cost nothing.
  bool planarIsStable() const
  {
    RodSystem system(model_);
    system.load(state_);
    system.setResponse(0.0, nullptr);
    for (int i = 0; i < edges_; ++i)
      system.setInertia(i, 1e-6 * 2 * M_PI / edges_, state_.x.col(i), Eigen::Vector3d::Zero());
    return system.evaluate(true).inertia.positiveDefinite();
  }

  /// The same of the isotropic formulation, which has no Hessian: differences of its gradient in the modes of two waves
  /// around the ring. By symmetry the first instability is one of these.
  bool planarIsStableIsotropic() const
  {
    Eigen::MatrixXd modes(3 * edges_, 6);
    for (int i = 0; i < edges_; ++i)
    {
      const double phi = 2 * M_PI * i / edges_;
      const Eigen::Vector3d axes[3] = {
          {std::cos(phi), std::sin(phi), 0}, {-std::sin(phi), std::cos(phi), 0}, {0, 0, 1}};
      for (int k = 0; k < 3; ++k)
      {
        modes.block<3, 1>(3 * i, 2 * k) = std::cos(2 * phi) * axes[k];
        modes.block<3, 1>(3 * i, 2 * k + 1) = std::sin(2 * phi) * axes[k];
      }
    }
    modes *= std::sqrt(2.0 / edges_);
    RodSystem system(model_);
    IsotropicRod rod(model_, system);
    const double step = 1e-5;
    const auto gradient = [&](const Eigen::VectorXd& displacement) {
      rod.evaluate(state_);
      RodState moved = state_;
      moved.x += Eigen::Map<const Eigen::Matrix3Xd>(displacement.data(), 3, edges_);
      if (rod.settle(state_, {}, moved) != StepFailure::none)
        throw std::runtime_error("michell: the ring folded");
      rod.evaluate(moved);
      Eigen::VectorXd g(3 * edges_);
      for (int i = 0; i < edges_; ++i)
        g.segment<3>(3 * i) = rod.nodeGradient(i);
      return g;
    };
    Eigen::Matrix<double, 6, 6> hessian;
    for (int k = 0; k < 6; ++k)
      hessian.col(k) =
          modes.transpose() * (gradient(step * modes.col(k)) - gradient(-step * modes.col(k))) / (2 * step);
    return Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 6, 6>>(0.5 * (hessian + hessian.transpose()))
               .eigenvalues()[0] > 0;
  }

  /// Growth of a small lateral push of the second mode over a damped motion of two seconds: above 1, unstable.
  double growth() const
  {
    auto model = std::make_shared<RodModel>(model_);
    model->mass_damping = 2.0;
    RodState state = state_;
    const double size = 1e-4;
    for (int i = 0; i < edges_; ++i)
      state.x(2, i) = size * std::cos(4 * M_PI * i / edges_);
    const Eigen::Matrix3Xd nodes = state.x;
    state = makeRodState(*model, nodes, Eigen::Vector3d::UnitZ());
    RodInputs inputs;
    inputs.gravity.setZero();
    RodStepper stepper(model, timeConfig(Integrator::implicit_euler, 0.05, 1e-9));
    double early = 0, late = 0;
    for (int k = 0; k < 400; ++k)
    {
      require(stepper.step(state, inputs, 0.05), "ring");
      if (k == 100 || k == 399)
        (k == 100 ? early : late) = (state.x.row(2).array() - state.x.row(2).mean()).abs().maxCoeff();
    }
    return late / early;
  }

  /// By bisection between half and twice the expected twist.
  double threshold(double expected, bool isotropic)
  {
    double stable = 0.5 * expected, unstable = 2.0 * expected;
    for (int i = 0; i < 40; ++i)
    {
      const double middle = 0.5 * (stable + unstable);
      twist(middle);
      ((isotropic ? planarIsStableIsotropic() : planarIsStable()) ? stable : unstable) = middle;
    }
    return stable;
  }

private:
  int edges_;
  RodModel model_;
  RodState state_;
};

}   // namespace

void runMichell(StudyContext& context)
{
  Plot& plot =
      context.plot("michell", "Michell's instability of a twisted ring, n = 50", "beta / alpha", "twist [rad]");
  plot.log_x = plot.log_y = false;
  const double step = context.quick() ? 0.5 : 0.1;
  const std::vector<int> meshes = {50, 100};
  const int points = static_cast<int>(std::lround(2.0 / step)) + 1;
  int done = 0;
  for (const int edges : meshes)
    for (int k = 0; k < points; ++k)
    {
      const double beta = 0.5 + step * k;
      context.progress(done++, points * 2, "n = " + std::to_string(edges));
      const double smooth = 2 * M_PI * std::sqrt(3.0) / beta, expected = smooth * (1 + 31.3 / (edges * edges));
      Ring ring(edges, beta, Curvature::tangent);
      const double stable = ring.threshold(expected, false), isotropic = ring.threshold(expected, true);
      const auto row = [&](const char* formulation) -> Row& {
        return context.row().set("n", edges).set("beta_over_alpha", beta).set("formulation", formulation);
      };
      const char* source = "reference 2b: closed n-gon, 2 pi sqrt 3 (1 + 31.3/n^2)";
      row("general").check(stable, expected, 0.01 * expected, source);
      row("isotropic").check(isotropic, expected, 0.01 * expected, source);
      row("both").check(isotropic, stable, 1e-3 * stable,
                        "the other formulation; the smallest differences of a gradient and the general one's weight on "
                        "rigid motions");
      if (edges != 50)
        continue;
      const double compensated = Ring(edges, beta, Curvature::compensated).threshold(expected, false);
      context.row()
          .set("n", edges)
          .set("beta_over_alpha", beta)
          .set("curvature", "compensated")
          .set("relative_error", compensated / smooth - 1)
          .check(compensated, smooth, 0.0025 * smooth,
                 "2 pi sqrt 3 alpha / beta, continuous (the thesis's joints: 1.3 % off)");
      plot.at("compensated, n = 50").x.push_back(beta);
      plot.at("compensated, n = 50").y.push_back(compensated);
      plot.at("theory (continuous)").x.push_back(beta);
      plot.at("theory (continuous)").y.push_back(smooth);
      plot.at("measured, n = 50").x.push_back(beta);
      plot.at("measured, n = 50").y.push_back(stable);
      if (k % 5 != 0 && !context.quick())
        continue;
      // as in the thesis: does a small push decay or grow?
      for (const double share : {0.9, 0.97, 1.03, 1.1})
      {
        ring.twist(share * expected);
        const double growth = ring.growth();
        Row& row = context.row();
        row.set("n", edges).set("beta_over_alpha", beta).set("share_of_threshold", share).set("growth", growth);
        row.check(growth > 1 ? 1 : 0, share > 1 ? 1 : 0, 0.5, "1: a small push grows, 0: it decays");
        Series& dots = plot.at(growth > 1 ? "push grows" : "push decays");
        dots.points = true;
        dots.x.push_back(beta);
        dots.y.push_back(share * expected);
      }
    }
}

const StudyRegistration kMichellRegistration{
    "michell", "twist at which a ring leaves its plane, by the energy's Hessian and by the growth of a push",
    runMichell};

}   // namespace slender::study
