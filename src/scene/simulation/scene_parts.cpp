#include "scene_parts.h"

namespace slender {

namespace {

/// Lets tracked objects of a kind follow their guides.
template <class Configs, class Models>
void addGuides(ObjectRef::Kind kind, const Configs& configs, Models& models, std::vector<GuideRef>& guides)
{
  for (std::size_t k = 0; k < configs.size(); ++k)
  {
    const auto& tracking = configs[k].tracking;
    if (!tracking)
      continue;
    const auto* leader = std::get_if<ClothGuide>(&tracking->guide.motion);
    models[k].tracked = {
        {tracking, &tracking->sets}, tracking->size, leader ? leader->cloth : -1, static_cast<int>(guides.size())};
    guides.push_back({{kind, static_cast<int>(k)}, configs[k].name, tracking.get()});
  }
}

}   // namespace

SceneParts buildParts(SceneConfig& scene)
{
  SceneParts parts;
  parts.inputs.gravity = scene.gravity;
  parts.model.time = scene.time;
  parts.model.contact.gap = scene.contact.gap;
  parts.model.contact.slip_speed = scene.contact.slip_speed;
  buildRods(scene, parts);
  buildThreads(scene, parts);
  buildCloths(scene, parts);
  addGuides(ObjectRef::cloth, scene.cloths, parts.model.cloths, parts.guides);
  addGuides(ObjectRef::rod, scene.rods, parts.model.rods, parts.guides);
  checkClothContact(scene, parts.model);
  buildBodies(scene, parts);
  ignoreHeldContacts(scene, parts);
  parts.state.grasp_offsets.resize(parts.grasps.size());
  parts.state.wrenches.resize(parts.grasps.size());
  return parts;
}

void buildBodies(const SceneConfig& scene, SceneParts& parts)
{
  for (std::size_t b = 0; b < scene.bodies.size(); ++b)
  {
    const BodyConfig& config = scene.bodies[b];
    WorldModel::Body body;
    body.body = {config, !config.motion.has_value()};
    if (config.contact)
      body.shape = config.shape;
    body.X_BS = config.X_BS;
    body.friction = config.friction.value_or(-1.0);
    parts.model.bodies.push_back(std::move(body));
    for (const WeldConfig& weld : config.welds)
      parts.model.welds.push_back({weld.rod, weld.first_node, weld.last_node, static_cast<int>(b), std::nullopt});
    RigidBodyState state;
    state.X_WB = config.pose;
    state.velocity = config.velocity;
    parts.state.bodies.push_back(state);
  }
  for (const ObstacleConfig& obstacle : scene.obstacles)
  {
    parts.model.obstacles.push_back(obstacle);
    parts.state.obstacles.push_back(obstacle.pose);
    parts.state.obstacle_velocities.push_back({});
  }
}

std::string placeOf(const SceneConfig& scene, FailurePlace::Kind kind, int index)
{
  const std::string number = std::to_string(index), name = "scene " + scene.name;
  switch (kind)
  {
    case FailurePlace::Kind::rod:
    {
      const RodConfig& rod = scene.rods.at(index);
      return (rod.place.empty() ? name + ": rods." + number : rod.place) + " (" + rod.name + ")";
    }
    case FailurePlace::Kind::thread: return name + ": threads." + number;
    case FailurePlace::Kind::cloth:
    {
      const ClothConfig& cloth = scene.cloths.at(index);
      return cloth.place.empty() ? name + ": cloths." + number : cloth.place;
    }
    case FailurePlace::Kind::none: break;
  }
  return scene.file.empty() ? name : scene.file;
}

}   // namespace slender
