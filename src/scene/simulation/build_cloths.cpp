#include <algorithm>
#include <cmath>

#include "cloth_grasps.h"
#include "scene_parts.h"
#include "slender_sim/energy/plate_bending.h"
#include "slender_sim/scene/reader.h"

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
  warnings.push_back("cloth " + model.name + ": its shape at rest is curved (adjacent faces enclose up to " +
                     shortNumber(largestRestAngle(model) * 180 / M_PI, 3) +
                     " degrees), so it bends by hinges; the isometric model is for flat shapes at rest. Give bending: "
                     "{model: hinge} to choose that yourself.");
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
    warnings.push_back("cloth " + model.name +
                       ": with bending: {poissons_ratio} this mesh resists some curvatures by up to " +
                       std::to_string(std::lround(100 * excess)) +
                       " % more than the modulus says. Use a grid with pattern: equilateral or one_diagonal, or leave "
                       "poissons_ratio out.");
  }
}

ClothModel modelOf(const ClothConfig& config, std::vector<std::string>& warnings)
{
  ClothModel model = buildCloth(config.name, config.mesh, config.area_density, config.membrane, config.warp);
  static_cast<ClothProperties&>(model) = config;
  model.warp = config.warp.normalized();
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

void addCloth(SceneConfig& scene, int k, SceneParts& parts)
{
  const ClothConfig& config = scene.cloths[k];
  WorldModel::Cloth cloth;
  cloth.model = std::make_shared<const ClothModel>(modelOf(config, scene.warnings));
  static_cast<TimeConfig&>(cloth.options) = scene.time;
  static_cast<ClothSolving&>(cloth.options) = config;
  cloth.contact = config.contact;
  ClothState state = makeClothState(*cloth.model, config.start.cols() ? config.start : config.mesh.vertices);
  if (config.start_velocity.cols())
    state.v = config.start_velocity;
  std::vector<ClothGrasp> grasps;
  for (std::size_t g = 0; g < config.grasps.size(); ++g)
  {
    checkVertices(config.grasps[g].vertices, config, state, grasps, g);
    grasps.push_back(clothGraspOf(state, config.grasps[g].vertices));
    parts.grasps.push_back({{ObjectRef::cloth, k}, static_cast<int>(g), &config.grasps[g]});
  }
  gatherPins(grasps, state);
  if (config.tracking)
  {
    const TrackingConfig& tracking = *config.tracking;
    parts.state.cloth_guides.resize(scene.cloths.size());
    GuideState& guide = parts.state.cloth_guides[k];
    tracking.guide.evaluate(0.0, guide.points, tracking.sets.size() > 1 ? &guide.velocity : nullptr);
    guide.forces.setZero(3, tracking.sets[0].constraints->count());
  }
  parts.model.cloths.push_back(std::move(cloth));
  parts.state.cloths.push_back(std::move(state));
  parts.state.cloth_grasps.push_back(std::move(grasps));
}

/// Loads that act all the time.
ClothInputs loadsOf(const SceneConfig& scene, const ClothConfig& config)
{
  ClothInputs inputs;
  inputs.gravity = scene.gravity;
  if (!config.loads.empty())
    inputs.forces.setZero(3, config.mesh.vertices.cols());
  for (const ClothLoadConfig& load : config.loads)
    for (const int vertex : load.vertices)
      inputs.forces.col(vertex) += load.force;
  return inputs;
}

}   // namespace

void buildCloths(SceneConfig& scene, SceneParts& parts)
{
  buildEach(scene, FailurePlace::Kind::cloth, scene.cloths.size(), [&](int k) {
    addCloth(scene, k, parts);
    parts.inputs.cloths.push_back(loadsOf(scene, scene.cloths[k]));
  });
}

void checkClothContact(SceneConfig& scene, const WorldModel& model)
{
  const auto meetsOthers = [&](bool leads) {
    for (int k = 0; k < static_cast<int>(scene.cloths.size()); ++k)
      if (scene.cloths[k].contact && scene.cloths[k].contact->others && model.leads(k) == leads)
        return k;
    return -1;
  };
  if (const int guide = meetsOthers(true), other = meetsOthers(false); guide >= 0 && other >= 0)
  {
    scene.warnings.push_back("cloth " + scene.cloths[guide].name +
                             " is the guide of another cloth and is stepped ahead of it: it passes through cloth " +
                             scene.cloths[other].name +
                             " and all others that are no guides. Give both contact: {cloths: false} if that is meant");
  }
  const bool obstacles = std::any_of(scene.cloths.begin(), scene.cloths.end(), [](const ClothConfig& cloth) {
    return cloth.contact && cloth.contact->solids && cloth.contact->method == ContactMethod::impulses;
  });
  for (const BodyConfig& body : scene.bodies)
  {
    if (obstacles && body.isSimulatedSolid())
    {
      throw SceneError(placeOf(scene, FailurePlace::Kind::none, -1) + ": body " + body.name +
                       " is simulated, and contact of cloth by impulses does not push bodies; give it a motion or "
                       "contact: false, or the cloth contact: {method: barrier}");
    }
  }
}

}   // namespace slender
