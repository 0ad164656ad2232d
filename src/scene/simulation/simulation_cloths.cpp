// Cloths of a scene and what holds them.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <stdexcept>

#include "slender_sim/energy/plate_bending.h"
#include "slender_sim/scene/reader.h"
#include "slender_sim/scene/simulation.h"

namespace slender {

namespace {

/// Isometric bending, the default, is for flat shapes at rest. Curved ones bend by hinges, which have the same
/// small-angle limit.
void chooseBending(ClothModel& model, std::vector<std::string>& warnings)
{
  if (model.bending != BendingModel::isometric_nonconforming || !(model.bending_modulus > 0) ||
      model.bending_poissons_ratio || restsFlat(model))
    return;
  model.bending = BendingModel::hinge;
  char angle[32];
  std::snprintf(angle, sizeof angle, "%.3g", largestRestAngle(model) * 180 / M_PI);
  warnings.push_back(
      "cloth " + model.name + ": its shape at rest is curved (adjacent faces enclose up to " + angle +
      " degrees), so it bends by hinges; "
      "the isometric model is for flat shapes at rest. Give bending: {model: hinge} to choose that yourself.");
}

/// Bending with a Poisson's ratio of its own is exact on meshes of parallelograms only.
void checkPlate(const ClothModel& model, std::vector<std::string>& warnings)
{
  constexpr double kNoticeable = 0.02;   // the bound of the study plate
  if (!model.bending_poissons_ratio || model.bending != BendingModel::isometric_nonconforming ||
      !(model.bending_modulus > 0) || !restsFlat(model))
    return;
  const double excess = plateStiffening(model.rest, model.topology, *model.bending_poissons_ratio) - 1.0;
  if (excess > kNoticeable)
  {
    char percent[32];
    std::snprintf(percent, sizeof percent, "%.0f", 100 * excess);
    warnings.push_back("cloth " + model.name +
                       ": with bending: {poissons_ratio} this mesh resists some curvatures by up to " + percent +
                       " % more than the modulus says. Use a grid with pattern: equilateral or one_diagonal, or leave "
                       "poissons_ratio out.");
  }
}

ClothModel modelOf(const ClothConfig& config, std::vector<std::string>& warnings)
{
  ClothModel model = buildCloth(config.name, config.mesh, config.area_density, config.membrane, config.warp);
  model.bending = config.bending;
  model.bending_modulus = config.bending_modulus;
  model.bending_poissons_ratio = config.bending_poissons_ratio;
  model.mass_damping = config.mass_damping;
  model.stiffness_damping = config.stiffness_damping;
  model.wind_coefficient = config.drag;
  model.aerodynamics = config.aerodynamics;
  model.plasticity = config.plasticity;
  model.undeformed = config.undeformed;
  chooseBending(model, warnings);
  checkPlate(model, warnings);
  for (const GraspConfig& grasp : config.grasps)
    if (grasp.clamp)
      clampFaces(model, grasp.vertices);
  for (std::size_t s = 0; config.tracking && s < config.tracking->sets.size(); ++s)
  {
    const FunctionSet& set = config.tracking->sets[s];
    model.averages.push_back({{set.constraints, &set.constraints->matrix()}, set.bounds});
  }
  return model;
}

ClothOptions optionsOf(const ClothConfig& config, const TimeConfig& time)
{
  ClothOptions options;
  options.integrator = time.integrator;
  options.one_newton_step = config.one_newton_step;
  options.solver = config.solver;
  options.linear_tolerance = config.linear_tolerance;
  options.newton = time.newton;
  options.error_tolerance = time.error_tolerance;
  options.min_step = time.min_step;
  return options;
}

Pose normalized(const Pose& pose) { return {pose.position, pose.orientation.normalized()}; }

ClothGrasp graspOf(const ClothState& cloth, std::vector<int> vertices)
{
  ClothGrasp grasp;
  const auto count = static_cast<Eigen::Index>(vertices.size());
  grasp.points_G.resize(3, count);
  for (Eigen::Index k = 0; k < count; ++k)
    grasp.points_G.col(k) = cloth.x.col(vertices[k]);
  grasp.X_WG.position = grasp.points_G.rowwise().mean();
  grasp.points_G.colwise() -= grasp.X_WG.position;
  grasp.vertices = std::move(vertices);
  return grasp;
}

/// Throws unless the vertices, ascending, are those of the cloth, differ, and no active grasp but the one at `index`
/// holds them.
void checkVertices(const std::vector<int>& vertices, const ClothConfig& config, const SceneCloth& held,
                   std::size_t index)
{
  const std::string name = "grasp " + config.grasps[index].name;
  const auto count = held.cloth.x.cols();
  if (vertices.empty())
    throw std::invalid_argument(name + " holds no vertex; give it at least one");
  if (vertices.front() < 0 || vertices.back() >= count)
  {
    throw std::invalid_argument(name + " holds vertex " +
                                std::to_string(vertices.front() < 0 ? vertices.front() : vertices.back()) +
                                "; must be in [0, " + std::to_string(count - 1) + "]");
  }
  for (std::size_t other = 0; other < held.grasps.size(); ++other)
  {
    const ClothGrasp& grasp = held.grasps[other];
    for (const int vertex : grasp.vertices)
    {
      if (other != index && grasp.active && std::binary_search(vertices.begin(), vertices.end(), vertex))
      {
        throw std::invalid_argument(name + " holds vertex " + std::to_string(vertex) + ", which grasp " +
                                    config.grasps[other].name + " holds already");
      }
    }
  }
}

}   // namespace

void Simulation::buildCloths()
{
  for (std::size_t k = 0; k < config_.cloths.size(); ++k)
  {
    const ClothConfig& config = config_.cloths[k];
    try
    {
      cloth_models_.push_back(std::make_shared<const ClothModel>(modelOf(config, config_.warnings)));
      cloth_steppers_.emplace_back();
      if (!config.contact)
        cloth_steppers_.back().emplace(cloth_models_.back(), optionsOf(config, config_.time));
      SceneCloth held;
      held.cloth = makeClothState(*cloth_models_.back(), config.start.cols() ? config.start : config.mesh.vertices);
      if (config.start_velocity.cols())
        held.cloth.v = config.start_velocity;
      for (std::size_t g = 0; g < config.grasps.size(); ++g)
      {
        checkVertices(config.grasps[g].vertices, config, held, g);
        held.grasps.push_back(graspOf(held.cloth, config.grasps[g].vertices));
        grasps_.push_back({-1, static_cast<int>(g), &config.grasps[g], static_cast<int>(k)});
      }
      gatherPins(held);
      state_.cloths.push_back(std::move(held));
      if (config.tracking)
        startTracking(static_cast<int>(k));
    }
    catch (const std::invalid_argument& error)
    {
      throw SceneError(
          (config.place.empty() ? "scene " + config_.name + ": cloths." + std::to_string(k) : config.place) + ": " +
          error.what());
    }
  }
  cloth_inputs_.resize(config_.cloths.size());
  for (std::size_t k = 0; k < config_.cloths.size(); ++k)
  {
    if (!config_.cloths[k].loads.empty())
      cloth_inputs_[k].forces.setZero(3, config_.cloths[k].mesh.vertices.cols());
    for (const ClothLoadConfig& load : config_.cloths[k].loads)
      for (const int vertex : load.vertices)
        cloth_inputs_[k].forces.col(vertex) += load.force;
  }
  cloth_targets_.resize(grasps_.size());
  leads_.assign(config_.cloths.size(), 0);
  for (const ClothConfig& config : config_.cloths)
    if (const auto* preview = config.tracking ? std::get_if<ClothGuide>(&config.tracking->guide.motion) : nullptr)
      leads_[preview->cloth] = 1;
}

/// Those with contact. Guides feel only each other: they are where they are before what tracks them is.
void Simulation::buildTouchingCloths()
{
  if (std::none_of(config_.cloths.begin(), config_.cloths.end(),
                   [](const ClothConfig& cloth) { return cloth.contact.has_value(); }))
    return;
  cloth_places_.resize(config_.cloths.size());
  for (std::size_t b = 0; b < config_.bodies.size(); ++b)
    if (config_.bodies[b].shape && config_.bodies[b].contact && !isSimulated(static_cast<int>(b)))
      cloth_bodies_.push_back(static_cast<int>(b));
  const auto meetsOthers = [this](bool leads) {
    for (std::size_t k = 0; k < config_.cloths.size(); ++k)
      if (config_.cloths[k].contact && config_.cloths[k].contact->cloths && static_cast<bool>(leads_[k]) == leads)
        return static_cast<int>(k);
    return -1;
  };
  if (const int guide = meetsOthers(true), other = meetsOthers(false); guide >= 0 && other >= 0)
  {
    config_.warnings.push_back(
        "cloth " + config_.cloths[guide].name +
        " is the guide of another cloth and is stepped ahead of it: it passes through cloth " +
        config_.cloths[other].name +
        " and all others that are no guides. Give both contact: {cloths: false} if that is meant");
  }
  try
  {
    buildTouchingCloths(true);
    buildTouchingCloths(false);
    checkTouchingCloths(state_);
  }
  catch (const std::invalid_argument& error)
  {
    throw SceneError((config_.file.empty() ? "scene " + config_.name : config_.file) + ": " + error.what());
  }
}

void Simulation::buildTouchingCloths(bool ahead)
{
  ClothGroupModel model;
  std::vector<int> cloths;
  bool obstacles = false;
  for (std::size_t k = 0; k < config_.cloths.size(); ++k)
  {
    const auto& contact = config_.cloths[k].contact;
    if (contact && static_cast<bool>(leads_[k]) == ahead)
    {
      cloth_places_[k] = {static_cast<int>(touching_cloths_.size()), static_cast<int>(cloths.size())};
      cloths.push_back(static_cast<int>(k));
      model.cloths.push_back(cloth_models_[k]);
      model.contact.push_back(
          {contact->thickness, contact->friction, contact->self, contact->cloths, contact->obstacles});
      model.options.push_back(optionsOf(config_.cloths[k], config_.time));
      obstacles = obstacles || contact->obstacles;
    }
  }
  if (model.cloths.empty())
    return;
  const auto add = [&model](const std::string& name, const Shape& shape, const std::optional<double>& friction) {
    ContactSolid solid;
    solid.shape = shape;
    solid.friction = friction.value_or(-1.0);
    model.solids.push_back(std::move(solid));
    model.solid_names.push_back(name);
  };
  for (const ObstacleConfig& obstacle : config_.obstacles)
    add(obstacle.name, obstacle.shape, obstacle.friction);
  for (const int b : cloth_bodies_)
    add(config_.bodies[b].name, *config_.bodies[b].shape, config_.bodies[b].friction);
  for (std::size_t b = 0; obstacles && b < config_.bodies.size(); ++b)
  {
    const BodyConfig& body = config_.bodies[b];
    if (body.shape && body.contact && isSimulated(static_cast<int>(b)))
    {
      throw std::invalid_argument("body " + body.name +
                                  " is simulated, and cloth does not push bodies; give it a motion or contact: false");
    }
  }
  const ClothOptions common = model.options.front();
  touching_cloths_.push_back({ahead, std::move(cloths), ClothGroup(std::move(model), common)});
}

/// Hands the part of a state over that cloths with contact need, or back. Obstacles and bodies are moved by others.
void Simulation::exchangeTouchingCloths(SceneState& state, TouchingCloths& touching)
{
  touching.state.cloths.resize(touching.cloths.size());
  for (std::size_t k = 0; k < touching.cloths.size(); ++k)
    std::swap(touching.state.cloths[k], state.cloths[touching.cloths[k]].cloth);
  touching.state.solids = state.obstacles;
  for (const int b : cloth_bodies_)
    touching.state.solids.push_back(state.bodies[b].X_WB * config_.bodies[b].X_BS);
}

/// Throws std::invalid_argument where cloths meet something.
void Simulation::checkTouchingCloths(SceneState& state)
{
  for (TouchingCloths& touching : touching_cloths_)
  {
    exchangeTouchingCloths(state, touching);
    try
    {
      touching.group.checkIntersections(touching.state);
    }
    catch (...)
    {
      exchangeTouchingCloths(state, touching);
      throw;
    }
    exchangeTouchingCloths(state, touching);
  }
}

void Simulation::gatherPins(SceneCloth& cloth) const
{
  cloth.cloth.pins.clear();
  for (const ClothGrasp& grasp : cloth.grasps)
    if (grasp.active)
      pinVertices(cloth.cloth, grasp.vertices);
}

/// What acts on the cloths by the end of a step, and where their grasps are then.
void Simulation::fillClothInputs(const SceneInputs& inputs)
{
  for (std::size_t k = 0; k < cloth_inputs_.size(); ++k)
  {
    cloth_inputs_[k].gravity = config_.gravity;
    cloth_inputs_[k].wind = inputs.wind;
    cloth_inputs_[k].pins.resize(3, static_cast<Eigen::Index>(state_.cloths[k].cloth.pins.size()));
  }
  for (std::size_t g = 0; g < grasps_.size(); ++g)
  {
    const GraspRef& ref = grasps_[g];
    if (ref.cloth < 0 || !isActive(static_cast<int>(g)))
      continue;
    Pose& X_WG = cloth_targets_[g];
    X_WG = drivenTarget(static_cast<int>(g), inputs).X_WG;
    X_WG.orientation.normalize();
    const SceneCloth& cloth = state_.cloths[ref.cloth];
    const ClothGrasp& grasp = cloth.grasps[ref.index];
    for (std::size_t p = 0; p < grasp.vertices.size(); ++p)
    {
      const auto pin = std::lower_bound(cloth.cloth.pins.begin(), cloth.cloth.pins.end(), grasp.vertices[p]) -
                       cloth.cloth.pins.begin();
      cloth_inputs_[ref.cloth].pins.col(pin) = X_WG * grasp.points_G.col(static_cast<Eigen::Index>(p));
    }
  }
}

StepReport Simulation::stepCloths(const SceneInputs& inputs)
{
  StepReport total;
  fillClothInputs(inputs);
  stepCloths(true, inputs, total);
  stepCloths(false, inputs, total);
  return total;
}

/// Guides, or what is none.
void Simulation::stepCloths(bool ahead, const SceneInputs& inputs, StepReport& total)
{
  for (std::size_t k = 0; k < cloth_steppers_.size() && total.ok; ++k)
  {
    if (static_cast<bool>(leads_[k]) != ahead)
      continue;
    if (config_.cloths[k].tracking)
    {
      functions(static_cast<int>(k))
          .constraints->averages(guideVertices(static_cast<int>(k), inputs), cloth_inputs_[k].averages);
      state_.cloths[k].blend.apply(static_cast<double>(state_.steps + 1) * config_.time.step,
                                   cloth_inputs_[k].averages);
    }
    if (cloth_steppers_[k])
      total.merge(cloth_steppers_[k]->step(state_.cloths[k].cloth, cloth_inputs_[k], config_.time.step));
  }
  for (TouchingCloths& touching : touching_cloths_)
  {
    if (touching.ahead != ahead || !total.ok)
      continue;
    touching.inputs.cloths.resize(touching.cloths.size());
    for (std::size_t k = 0; k < touching.cloths.size(); ++k)
      touching.inputs.cloths[k] = cloth_inputs_[touching.cloths[k]];
    touching.inputs.solids.clear();
    for (const GraspTarget& obstacle : inputs.obstacles)
      touching.inputs.solids.push_back(normalized(obstacle.X_WG));
    for (const int b : cloth_bodies_)
      touching.inputs.solids.push_back(normalized(inputs.bodies[b].X_WG) * config_.bodies[b].X_BS);
    exchangeTouchingCloths(state_, touching);
    total.merge(touching.group.step(touching.state, touching.inputs, config_.time.step));
    exchangeTouchingCloths(state_, touching);
  }
}

/// After a step: the grasps are where they were to go.
void Simulation::takeClothWrenches()
{
  for (std::size_t g = 0; g < grasps_.size(); ++g)
  {
    const GraspRef& ref = grasps_[g];
    if (ref.cloth < 0 || !isActive(static_cast<int>(g)))
      continue;
    SceneCloth& held = state_.cloths[ref.cloth];
    ClothGrasp& grasp = held.grasps[ref.index];
    grasp.X_WG = cloth_targets_[g];
    const Eigen::Matrix3Xd& forces = pinForces(ref.cloth);
    Wrench wrench;
    for (const int vertex : grasp.vertices)
    {
      const auto pin =
          std::lower_bound(held.cloth.pins.begin(), held.cloth.pins.end(), vertex) - held.cloth.pins.begin();
      const Eigen::Vector3d force = forces.col(pin);
      wrench.force += force;
      wrench.torque += (held.cloth.x.col(vertex) - grasp.X_WG.position).cross(force);
    }
    state_.wrenches[g] = wrench;
  }
}

void Simulation::attachVertices(int grasp, std::vector<int> vertices)
{
  checkGrasp(grasp);
  const GraspRef& ref = grasps_[grasp];
  if (ref.cloth < 0)
    throw std::invalid_argument("grasp " + ref.config->name + " holds a rod, which has nodes");
  std::sort(vertices.begin(), vertices.end());
  vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
  SceneCloth& held = state_.cloths[ref.cloth];
  checkVertices(vertices, config_.cloths[ref.cloth], held, static_cast<std::size_t>(ref.index));
  held.grasps[ref.index] = graspOf(held.cloth, std::move(vertices));
  gatherPins(held);
  takeOffset(grasp, state_.time);
}

void Simulation::release(int grasp)
{
  checkGrasp(grasp);
  const GraspRef& ref = grasps_[grasp];
  if (ref.cloth >= 0)
  {
    SceneCloth& held = state_.cloths[ref.cloth];
    held.grasps[ref.index].active = false;
    gatherPins(held);
  }
  else
  {
    graspState(grasp).active = false;
    state_.rods[ref.rod].forgetHistory();
  }
  state_.wrenches[grasp] = {};
}

}   // namespace slender
