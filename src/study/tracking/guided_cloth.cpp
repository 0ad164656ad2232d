#include "guided_cloth.h"

namespace slender::study {

using Eigen::Matrix3Xd;

WeakConstraints GuidedCloth::constraints() const { return {functions, hatMassMatrix(guide), hatMassMatrix(fine.mesh)}; }

Matrix3Xd GuidedCloth::velocity(double t) const
{
  constexpr double kDelta = 1e-5;   // [s]: errors of a ten-thousandth of motions within 0.1 s
  return (at(t + kDelta) - at(t - kDelta)) / (2 * kDelta);
}

namespace {

ClothModel modelOf(const GuidedCloth& c, Follow how, const WeakConstraints& constraints)
{
  ClothModel model = c.model;
  if (how == Follow::averages)
    model.averages = {{std::make_shared<const WeakConstraints::Matrix>(constraints.matrix()), {}}};
  return model;
}

ClothOptions optionsOf(const GuidedCloth& c)
{
  ClothOptions options;
  options.one_newton_step = c.one_newton_step;
  options.linear_tolerance = c.linear_tolerance;
  return options;
}

}   // namespace

GuidedStepper::GuidedStepper(const GuidedCloth& c, Follow how)
  : case_(c),
    how_(how),
    constraints_(std::make_shared<const WeakConstraints>(c.constraints())),
    cloth_(modelOf(c, how, *constraints_)),
    stepper_(cloth_.model, optionsOf(c)),
    guide_(c.at(0.0))
{
  cloth_.state = makeClothState(*cloth_.model, guide_ * c.fine.weights.transpose());
  cloth_.state.v = c.velocity(0.0) * c.fine.weights.transpose();
  cloth_.inputs.gravity = c.gravity;
  cloth_.inputs.wind = c.wind;
  if (how == Follow::points)
  {
    std::vector<int> shared(static_cast<std::size_t>(guide_.cols()));
    for (std::size_t k = 0; k < shared.size(); ++k)
      shared[k] = static_cast<int>(k);
    cloth_.pin(shared);
  }
}

StepReport GuidedStepper::step() { return step(case_.at(time_ + case_.step)); }

StepReport GuidedStepper::step(const Matrix3Xd& guide)
{
  if (how_ == Follow::averages)
    cloth_.inputs.averages = constraints_->averages(guide);
  else if (how_ == Follow::points)
    cloth_.inputs.pins = guide;
  const double start = threadSeconds();
  const StepReport report = stepper_.step(cloth_.state, cloth_.inputs, case_.step);
  seconds_ += threadSeconds() - start;
  if (report.ok)
  {
    guide_ = guide;
    time_ += case_.step;
  }
  return report;
}

FineScale::FineScale(const GuidedCloth& c)
  : weights_(c.fine.weights),
    mass_(hatMassMatrix(c.fine.mesh)),
    coarse_(Eigen::MatrixXd(weights_.transpose() * mass_ * weights_)),
    density_(c.model.totalMass() / faceAreas(c.fine.mesh).sum())
{
}

Matrix3Xd FineScale::of(const Matrix3Xd& field) const
{
  const Eigen::MatrixXd moments = weights_.transpose() * (mass_ * field.transpose());
  return field - (weights_ * coarse_.solve(moments)).transpose();
}

double FineScale::kineticEnergy(const Matrix3Xd& velocities) const
{
  const Eigen::MatrixXd fine = of(velocities).transpose();
  return 0.5 * density_ * (fine.transpose() * (mass_ * fine)).trace();
}

TriangleMesh guideSheet(double side, int cells, double height)
{
  TriangleMesh mesh = gridMesh(side, side, cells, cells, GridPattern::alternating);
  mesh.vertices.colwise() += Eigen::Vector3d(-0.5 * side, -0.5 * side, height);
  return mesh;
}

}   // namespace slender::study
