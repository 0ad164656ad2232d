#include "scene_rod.h"

#include <cmath>
#include <stdexcept>

#include "slender_sim/rod/natural_frames.h"
#include "slender_sim/scene/shapes.h"

namespace slender {

namespace {

void setDamping(const Damping& damping, RodModel& model)
{
  model.mass_damping = damping.mass;
  model.stiffness_damping = damping.stiffness;
  if (damping.drag > 0)
  {
    model.drag.setZero(model.nodes());
    for (int j = 0; j < model.edges(); ++j)
    {
      const double half = 0.5 * damping.drag * model.rest_length[j];
      model.drag[j] += half;
      model.drag[(j + 1) % model.nodes()] += half;
    }
  }
}

/// One entry per node from those of the scene, one per joint: the ends of an open rod continue their neighbours.
template <class Value>
std::vector<Value> perNode(const RodModel& model, const std::vector<Value>& values, const char* name)
{
  const std::size_t nodes = static_cast<std::size_t>(model.nodes()), joints = model.closed ? nodes : nodes - 2;
  if (values.size() == 1)
  {
    return std::vector<Value>(nodes, values[0]);
  }
  if (values.size() != joints)
  {
    throw std::invalid_argument(std::string(name) + " has " + std::to_string(values.size()) + " entries; must have 1 or " + std::to_string(joints) +
                                (model.closed ? " (one per node)" : " (one per inner node)"));
  }
  std::vector<Value> all = values;
  if (!model.closed)
  {
    all.insert(all.begin(), values.front());
    all.push_back(values.back());
  }
  return all;
}

/// Natural twist of each node [rad].
Eigen::VectorXd restTwist(const RodConfig& rod, const RodModel& model)
{
  if (rod.rest_twist.size() == 1)
  {
    return evenTwist(model, rod.rest_twist[0]);
  }
  const std::vector<double> values = perNode(model, rod.rest_twist, "rest_twist");
  Eigen::VectorXd twist = Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size()));
  if (!model.closed)
  {
    // half an edge at the ends, at the rate of the next joint
    const Eigen::VectorXd lengths = evenTwist(model, 1.0);
    const int last = model.nodes() - 1;
    twist[0] *= lengths[0] / lengths[1];
    twist[last] *= lengths[last] / lengths[last - 1];
  }
  return twist;
}

/// Turns the natural frames. The frames of a ring must meet again where it is closed: what is left of the total twist after whole turns
/// becomes natural twist of the opposite sign, which an isotropic rod does not feel.
void setNaturalFrames(const RodConfig& rod, SceneRod& built)
{
  RodModel& model = built.model;
  Eigen::VectorXd twist;   // empty without rest_twist: rods that do not name it allocate nothing for it
  if (!rod.rest_twist.empty())
  {
    twist = restTwist(rod, model);
  }
  const double total = rod.initial_twist + twist.sum();
  double offset = model.closed ? std::remainder(total, 2 * M_PI) : 0.0;
  if (std::abs(offset) < 1e-6)   // round-off of whole turns that the scene gives by decimals
  {
    offset = 0.0;
  }
  if (offset != 0.0 && !isIsotropic(model))
  {
    throw std::invalid_argument("the axes of its sections do not meet where the loop is closed; initial_twist and rest_twist of a closed rod that bends "
                                "differently in different directions must add up to a multiple of 2 pi, got " + std::to_string(total));
  }
  if (!rod.rest_twist.empty() || offset != 0.0)
  {
    if (twist.size() == 0)
    {
      twist.setZero(model.nodes());
    }
    twist -= evenTwist(model, offset);
    addNaturalTwist(model, twist);
    built.initial_twist = twist;
    const double joints = model.closed ? model.nodes() : model.nodes() - 2;
    for (int i = model.closed ? 0 : 1; i < (model.closed ? model.nodes() : model.nodes() - 1); ++i)
    {
      built.initial_twist[i] += rod.initial_twist / joints;
    }
  }
  if (!rod.natural_curvature.empty())
  {
    const std::vector<Eigen::Vector2d> values = perNode(model, rod.natural_curvature, "natural_curvature");
    setNaturalCurvature(model, Eigen::Map<const Eigen::Matrix2Xd>(values[0].data(), 2, static_cast<Eigen::Index>(values.size())));
  }
}

SceneRod buildWith(const JointOptions& joints, const RodConfig& rod, const Eigen::Matrix3Xd& rest, const Eigen::Vector3d& gravity)
{
  const int edges = static_cast<int>(rod.closed ? rest.cols() : rest.cols() - 1);
  SceneRod built;
  RodModel& model = built.model;
  model = buildRod(rod.name, rest, rod.closed, rodSections(rod, edges), rod.director, rod.naturally_straight || !rod.natural_curvature.empty(), joints);
  if (rod.material.inextensible)
  {
    model.stretch_modulus = model.stretch_modulus.cwiseMax(1e5 * model.totalMass() * gravity.norm());
  }
  setDamping(rod.damping, model);
  setNaturalFrames(rod, built);
  return built;
}

/// Which equations explicit steps use; implicit ones always use the general formulation with stretching.
void chooseFormulation(const RodConfig& rod, bool explicit_steps, RodModel& model)
{
  const std::string obstacle = explicit_steps ? whyNotIsotropic(model) : "it takes explicit steps (time.integrator: symplectic_euler)";
  if (rod.formulation == Formulation::isotropic && !obstacle.empty())
  {
    throw std::invalid_argument("formulation: isotropic does not apply: " + obstacle + "; take formulation: auto");
  }
  if (rod.stretching == Stretching::projected && !explicit_steps)
  {
    throw std::invalid_argument("stretching: projected takes explicit steps (time.integrator: symplectic_euler); "
                                "with implicit ones take stretching: stiff and material.inextensible: true");
  }
  model.isotropic = rod.formulation != Formulation::general && obstacle.empty();
  model.inextensible = rod.stretching == Stretching::projected;
}

}  // namespace

SceneRod buildSceneRod(const RodConfig& rod, const Eigen::Matrix3Xd& rest, const Eigen::Vector3d& gravity, Integrator integrator)
{
  JointOptions joints = rod.joints;
  if (rod.automatic_curvature)
  {
    joints.curvature = Curvature::tangent;
  }
  SceneRod built = buildWith(joints, rod, rest, gravity);
  const bool explicit_steps = integrator == Integrator::symplectic_euler;
  // The isotropic formulation of explicit steps has the thesis's curvature without frames. Everywhere else the thesis's curvature makes
  // bending depend on how the frames twist, which a rod of isotropic sections must not.
  const bool without_frames = explicit_steps && rod.formulation != Formulation::general && whyNotIsotropic(built.model).empty();
  if (rod.automatic_curvature && isIsotropic(built.model) && !without_frames)
  {
    joints.curvature = Curvature::compensated;
    built = buildWith(joints, rod, rest, gravity);
  }
  chooseFormulation(rod, explicit_steps, built.model);
  return built;
}

RodState startSceneRod(const RodConfig& rod, const SceneRod& built, const Eigen::Matrix3Xd& initial)
{
  if (built.initial_twist.size() == 0)
  {
    return makeRodState(built.model, initial, rod.director, rod.initial_twist);
  }
  RodState state = makeRodState(built.model, initial, rod.director);
  addFrames(built.model, state);
  turnFramesAlong(state, built.initial_twist);
  return state;
}

}  // namespace slender
