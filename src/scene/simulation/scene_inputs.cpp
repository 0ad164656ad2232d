#include "scene_inputs.h"

#include <stdexcept>
#include <string>

namespace slender {

namespace {

void addThreads(const SceneConfig& config, const SceneState& state, double time, SceneInputs& inputs)
{
  inputs.threads.clear();
  for (std::size_t k = 0; k < config.threads.size(); ++k)
  {
    const ThreadConfig& thread = config.threads[k];
    const double start = time - config.time.step;
    ThreadDrive drive;
    if (thread.nozzle)
    {
      const auto* table = std::get_if<TableMotion>(&thread.nozzle->motion);
      drive.nozzle = table ? table->poses.evaluate(time) : state.threads[k].threads.front().ends[1].X_WE;
      drive.flow_rate = thread.nozzle->flow.table.mean(start, time);
    }
    if (thread.floor)
    {
      drive.belt_velocity << thread.floor->belt_x.table.mean(start, time), thread.floor->belt_y.table.mean(start, time),
          0.0;
    }
    inputs.threads.push_back(drive);
  }
}

void addGuides(const std::vector<GuideRef>& guides, const SceneState& state, double time, SceneInputs& inputs)
{
  inputs.guides.resize(guides.size());
  for (std::size_t g = 0; g < guides.size(); ++g)
  {
    const GuideConfig& guide = guides[g].tracking->guide;
    if (guide.byTopic() || std::holds_alternative<ClothGuide>(guide.motion))
      inputs.guides[g] = state.guide(guides[g].object).points;
    else
      guide.evaluate(time, inputs.guides[g]);
  }
}

}   // namespace

void sceneInputsAt(const SceneConfig& config, const std::vector<GuideRef>& guides, const SceneState& state, double time,
                   SceneInputs& inputs)
{
  inputs.wind = config.wind;
  const auto given = [time](const GivenMotion& motion, const Pose& now) {
    GraspTarget target{now, Twist{}};
    if (const auto* table = std::get_if<TableMotion>(&motion))
      target.X_WG = table->poses.evaluate(time, &*target.velocity);
    return target;
  };
  inputs.bodies.clear();
  for (std::size_t b = 0; b < config.bodies.size(); ++b)
    inputs.bodies.push_back(given(config.bodies[b].motion.value_or(FixedMotion{}), state.bodies[b].X_WB));
  inputs.obstacles.clear();
  for (std::size_t k = 0; k < config.obstacles.size(); ++k)
    inputs.obstacles.push_back(given(config.obstacles[k].motion, state.obstacles[k]));
  addThreads(config, state, time, inputs);
  addGuides(guides, state, time, inputs);
}

void checkSceneInputs(const SceneConfig& config, const std::vector<GuideRef>& guides, const SceneState& state,
                      std::size_t grasps, const SceneInputs& inputs)
{
  const auto check = [](const char* name, std::size_t given, std::size_t expected, const char* of) {
    if (given != expected)
      throw std::invalid_argument(std::string("inputs.") + name + " has " + std::to_string(given) +
                                  " targets; must have " + std::to_string(expected) + ", one per " + of +
                                  " of the scene");
  };
  check("grasps", inputs.grasps.size(), grasps, "grasp");
  check("bodies", inputs.bodies.size(), config.bodies.size(), "body");
  check("threads", inputs.threads.size(), config.threads.size(), "thread");
  check("obstacles", inputs.obstacles.size(), config.obstacles.size(), "obstacle");
  check("guides", inputs.guides.size(), guides.size(), "tracked object");
  for (std::size_t g = 0; g < guides.size(); ++g)
    if (const auto given = inputs.guides[g].cols(), expected = state.guide(guides[g].object).points.cols();
        given != expected)
      throw std::invalid_argument("inputs.guides of " + guides[g].name + " has " + std::to_string(given) +
                                  (guides[g].object.isCloth() ? " vertices" : " nodes") + "; must have " +
                                  std::to_string(expected));
}

void takeSceneInputs(const SceneConfig& config, const SceneState& initial, const SceneInputs& inputs,
                     WorldInputs& world)
{
  world.bodies = inputs.bodies;
  world.obstacles = inputs.obstacles;
  world.guides = inputs.guides;
  for (RodInputs& rod : world.rods)
    rod.wind = inputs.wind;
  for (ClothInputs& cloth : world.cloths)
    cloth.wind = inputs.wind;
  for (std::size_t k = 0; k < world.threads.size(); ++k)
  {
    ThreadInputs& thread = world.threads[k];
    thread.gravity = config.gravity;
    for (int end = 0; end < 2; ++end)
      thread.ends[end] = initial.threads[k].threads.front().ends[end].X_WE;
    if (config.threads[k].nozzle)
    {
      thread.ends[1] = inputs.threads[k].nozzle;
      thread.flow_rate = inputs.threads[k].flow_rate;
    }
    thread.belt_velocity = inputs.threads[k].belt_velocity;
  }
}

}   // namespace slender
