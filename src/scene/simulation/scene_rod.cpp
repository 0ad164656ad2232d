#include "scene_rod.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "slender_sim/geometry/rotation.h"
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
    return std::vector<Value>(nodes, values[0]);
  if (values.size() != joints)
  {
    throw std::invalid_argument(std::string(name) + " has " + std::to_string(values.size()) +
                                " entries; must have 1 or " + std::to_string(joints) +
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
    return evenTwist(model, rod.rest_twist[0]);
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

/// Turns the natural frames. The frames of a ring must meet again where it is closed: what is left of the total twist
/// after whole turns becomes natural twist of the opposite sign, which an isotropic rod does not feel.
void setNaturalFrames(const RodConfig& rod, SceneRod& built)
{
  RodModel& model = built.model;
  Eigen::VectorXd twist;   // empty without rest_twist: rods that do not name it allocate nothing for it
  if (!rod.rest_twist.empty())
    twist = restTwist(rod, model);
  const double total = rod.initial_twist + twist.sum();
  double offset = model.closed ? std::remainder(total, 2 * M_PI) : 0.0;
  if (std::abs(offset) < 1e-6)   // round-off of whole turns that the scene gives by decimals
    offset = 0.0;
  if (offset != 0.0 && !isIsotropic(model))
  {
    throw std::invalid_argument(
        "the axes of its sections do not meet where the loop is closed; initial_twist and rest_twist of a closed rod "
        "that bends differently in different directions must add up to a multiple of 2 pi, got " +
        std::to_string(total));
  }
  if (!rod.rest_twist.empty() || offset != 0.0)
  {
    if (twist.size() == 0)
      twist.setZero(model.nodes());
    twist -= evenTwist(model, offset);
    addNaturalTwist(model, twist);
    built.initial_twist = twist;
    const double joints = model.closed ? model.nodes() : model.nodes() - 2;
    for (int i = model.closed ? 0 : 1; i < (model.closed ? model.nodes() : model.nodes() - 1); ++i)
      built.initial_twist[i] += rod.initial_twist / joints;
  }
  if (!rod.natural_curvature.empty())
  {
    const std::vector<Eigen::Vector2d> values = perNode(model, rod.natural_curvature, "natural_curvature");
    setNaturalCurvature(
        model, Eigen::Map<const Eigen::Matrix2Xd>(values[0].data(), 2, static_cast<Eigen::Index>(values.size())));
  }
}

SceneRod buildWith(const JointOptions& joints, const RodConfig& rod, const Eigen::Matrix3Xd& rest,
                   const Eigen::Vector3d& gravity)
{
  const int edges = static_cast<int>(rod.closed ? rest.cols() : rest.cols() - 1);
  SceneRod built;
  RodModel& model = built.model;
  model = buildRod(rod.name, rest, rod.closed, rodSections(rod, edges), rod.director,
                   rod.naturally_straight || !rod.natural_curvature.empty(), joints);
  if (rod.material.inextensible)
    model.stretch_modulus = model.stretch_modulus.cwiseMax(1e5 * model.totalMass() * gravity.norm());
  setDamping(rod.damping, model);
  setNaturalFrames(rod, built);
  return built;
}

bool bearsTorque(const RodConfig& rod)
{
  return std::any_of(rod.loads.begin(), rod.loads.end(), [](const RodLoadConfig& load) { return load.torque != 0; });
}

/// Why the isotropic formulation does not apply to a rod of the scene; empty when it does.
std::string whyNotIsotropic(const RodConfig& rod, const RodModel& model)
{
  return bearsTorque(rod) ? "it has loads with a torque, which turns material frames" : whyNotIsotropic(model);
}

/// Which equations explicit steps use; implicit ones always use the general formulation with stretching.
void chooseFormulation(const RodConfig& rod, bool explicit_steps, RodModel& model)
{
  const std::string obstacle =
      explicit_steps ? whyNotIsotropic(rod, model) : "it takes explicit steps (time.integrator: symplectic_euler)";
  if (rod.formulation == Formulation::isotropic && !obstacle.empty())
    throw std::invalid_argument("formulation: isotropic does not apply: " + obstacle + "; take formulation: auto");
  if (rod.stretching == Stretching::projected && !explicit_steps)
  {
    throw std::invalid_argument(
        "stretching: projected takes explicit steps (time.integrator: symplectic_euler); with implicit ones take "
        "stretching: stiff and material.inextensible: true");
  }
  model.isotropic = rod.formulation != Formulation::general && obstacle.empty();
  model.inextensible = rod.stretching == Stretching::projected;
}

/// Where a load acts: `share` of the way along an edge.
struct RodPlace
{
  int edge;
  double share;   ///< 0..1; exactly 0 or 1 at a node
};

RodPlace findPlace(const RodLoadConfig& load, const RodModel& model, const std::string& name)
{
  const int edges = model.edges();
  if (load.node >= 0)
  {
    if (load.node >= model.nodes())
    {
      throw std::invalid_argument(name + ": node = " + std::to_string(load.node) + "; must be in [0, " +
                                  std::to_string(model.nodes() - 1) + "]");
    }
    return load.node < edges ? RodPlace{load.node, 0.0} : RodPlace{edges - 1, 1.0};
  }
  constexpr double kAtNode = 1e-9;   // of the rod's length
  const double length = model.rest_length.sum();
  if (!(load.arc_length <= (1 + kAtNode) * length))
  {
    throw std::invalid_argument(name + ": at = " + std::to_string(load.arc_length) +
                                " m is beyond the end of the rod, which is " + std::to_string(length) + " m long");
  }
  double left = load.arc_length;
  int edge = 0;
  while (edge < edges - 1 && left > model.rest_length[edge] - kAtNode * length)
    left -= model.rest_length[edge++];
  const double near = kAtNode * length;
  const double share = left < near ? 0.0 : left > model.rest_length[edge] - near ? 1.0 : left / model.rest_length[edge];
  return {edge, share};
}

/// A torque is balanced by frames that are held, and its work is not known to all integrators.
void checkTorque(const RodConfig& rod, Integrator integrator)
{
  if (integrator == Integrator::implicit_midpoint || integrator == Integrator::generalized_alpha)
  {
    throw std::invalid_argument(
        "loads: a torque is not for time.integrator implicit_midpoint and generalized_alpha, whose check of the energy "
        "does not know its work; take tr_bdf2, bdf2, implicit_euler or symplectic_euler");
  }
  if (rod.tracking)
    throw std::invalid_argument("loads: a torque is not for rods that track a guide; leave torque out");
}

}   // namespace

SceneRod buildSceneRod(const RodConfig& rod, const Eigen::Matrix3Xd& rest, const Eigen::Vector3d& gravity,
                       Integrator integrator)
{
  JointOptions joints = rod.joints;
  if (rod.automatic_curvature)
    joints.curvature = Curvature::tangent;
  SceneRod built = buildWith(joints, rod, rest, gravity);
  const bool explicit_steps = integrator == Integrator::symplectic_euler;
  // The isotropic formulation of explicit steps has the thesis's curvature without frames. Everywhere else the thesis's
  // curvature makes bending depend on how the frames twist, which a rod of isotropic sections must not.
  const bool without_frames =
      explicit_steps && rod.formulation != Formulation::general && whyNotIsotropic(rod, built.model).empty();
  if (rod.automatic_curvature && isIsotropic(built.model) && !without_frames)
  {
    joints.curvature = Curvature::compensated;
    built = buildWith(joints, rod, rest, gravity);
  }
  chooseFormulation(rod, explicit_steps, built.model);
  return built;
}

RodInputs rodLoads(const RodConfig& rod, const RodModel& model, Integrator integrator)
{
  RodInputs loads;
  if (rod.loads.empty())
    return loads;
  const int n = model.nodes(), edges = model.edges();
  loads.forces.setZero(3, n);
  if (bearsTorque(rod))
  {
    checkTorque(rod, integrator);
    loads.torques.setZero(edges);
  }
  for (std::size_t k = 0; k < rod.loads.size(); ++k)
  {
    const RodLoadConfig& load = rod.loads[k];
    const std::string name = "loads." + std::to_string(k);
    const RodPlace place = findPlace(load, model, name);
    loads.forces.col(place.edge) += (1.0 - place.share) * load.force;
    loads.forces.col((place.edge + 1) % n) += place.share * load.force;
    if (load.torque == 0)
      continue;
    const bool inside = place.share > 0 && place.share < 1;
    const int other = place.share == 0 ? place.edge - 1 : place.edge + 1;   // the other edge at this node
    const bool has_other = !inside && (model.closed || (other >= 0 && other < edges));
    loads.torques[place.edge] += (has_other ? 0.5 : 1.0) * load.torque;
    if (has_other)
      loads.torques[(other + edges) % edges] += 0.5 * load.torque;
  }
  return loads;
}

double orientGrasp(GraspConfig& grasp, const Pose& section)
{
  if (grasp.direction.isZero(0) && grasp.director.isZero(0))
    return 0.0;
  const std::string name = "grasp " + grasp.name + ": ";
  const Eigen::Matrix3d now = section.orientation.toRotationMatrix();
  const Eigen::Vector3d tangent = grasp.direction.isZero(0) ? Eigen::Vector3d(now.col(0)) : grasp.direction;
  constexpr double kOpposite = -1.0 + 1e-9;
  if (grasp.director.isZero(0) && now.col(0).dot(tangent) < kOpposite)
  {
    throw std::invalid_argument(name +
                                "direction is opposite to the tangent at the start, so that nothing says how the "
                                "section turns; give director as well");
  }
  Eigen::Vector3d d1 = grasp.director.isZero(0) ? parallelTransport(now.col(1), now.col(0), tangent) : grasp.director;
  d1 -= tangent * tangent.dot(d1);
  if (!(d1.norm() > 1e-6))
    throw std::invalid_argument(name + "director is along the tangent of the section; must point away from it");
  d1.normalize();
  Eigen::Matrix3d axes;
  axes << tangent, d1, tangent.cross(d1);
  const Eigen::Quaterniond orientation = Eigen::Quaterniond(axes).normalized();
  std::vector<double> times{0.0};
  std::vector<Pose> poses{{section.position, orientation}};
  if (const auto* table = std::get_if<TableMotion>(&grasp.motion))
  {
    times = table->poses.times();
    poses = table->poses.poses();
    for (Pose& pose : poses)
      pose.orientation = orientation;
  }
  grasp.motion = TableMotion{PoseTrajectory(std::move(times), std::move(poses))};
  return rotationVector(section.orientation.conjugate() * orientation).norm();
}

RodState startSceneRod(const RodConfig& rod, const SceneRod& built, const Eigen::Matrix3Xd& initial)
{
  if (built.initial_twist.size() == 0)
    return makeRodState(built.model, initial, rod.director, rod.initial_twist);
  RodState state = makeRodState(built.model, initial, rod.director);
  addFrames(built.model, state);
  turnFramesAlong(state, built.initial_twist);
  return state;
}

}   // namespace slender
