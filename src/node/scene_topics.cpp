#include "slender_sim/node/scene_topics.h"

#include <stdexcept>

#include <ros/names.h>

namespace slender {
namespace {

const std::string& checkedName(const std::string& name, const std::string& kind)
{
  std::string why;
  if (name.empty() || name.find_first_of("/~") != std::string::npos || !ros::names::validate(name, why))
    throw std::invalid_argument(
        kind + " \"" + name + "\": the name cannot be part of a topic; use letters, digits and _, with a letter first");
  return name;
}

}   // namespace

SceneTopics::SceneTopics(const Simulation& simulation)
{
  const SceneConfig& scene = simulation.config();
  has_threads = !scene.threads.empty();
  has_cloths = !scene.cloths.empty();
  has_rods = !scene.rods.empty() || (!has_threads && !has_cloths);
  if (has_rods + has_threads + has_cloths > 1)
  {
    rods = "rods/";
    threads = "threads/";
    cloths = "cloths/";
  }
  for (const RodConfig& rod : scene.rods)
    checkedName(rod.name, "rod");
  for (const ClothConfig& cloth : scene.cloths)
    checkedName(cloth.name, "cloth");
  for (const GraspRef& grasp : simulation.grasps())
    grasps.push_back(checkedName(grasp.config->name, "grasp"));
  for (const ThreadConfig& thread : scene.threads)
  {
    const std::string& name = checkedName(thread.name, "thread");
    nozzles.push_back(scene.threads.size() == 1 ? std::string() : "threads/" + name + "/");
  }
}

}   // namespace slender
