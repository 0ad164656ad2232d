// What changes a run from outside: recorded beside its states, and repeated from such a record.
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <unistd.h>

#include "slender_sim/node/bag_paths.h"
#include "slender_sim/node/scene_node.h"
#include "slender_sim/node/scene_option.h"
#include "slender_sim/scene/reader.h"

namespace slender {
namespace {

using slender_sim::Input;
using slender_sim::SetGrasp;

/// The values that inputs of its kind have.
const std::vector<double>& values(const Input& input, std::size_t count)
{
  if (input.values.size() != count)
    throw std::runtime_error("its input " + std::to_string(input.number) + " has " +
                             std::to_string(input.values.size()) + " values, not " + std::to_string(count) +
                             "; the bag is damaged");
  return input.values;
}

}   // namespace

/// Before the options are used: the recorded ones take their place.
void SceneNode::openReplay()
{
  if (options_.replay.empty())
    return;
  replay_ = std::make_unique<InputReplay>(options_.replay);
  if (!options_.record_bag.empty())
    try
    {
      requireOtherBag(options_.record_bag, options_.replay, "~replay");
    }
    catch (const std::runtime_error& e)
    {
      throw OptionError(std::string("~record_bag: ") + e.what() + leftover("record_bag"));
    }
  if (options_.scene != replay_->scene() || !options_.overrides.empty())
    takeRecordedScene();
  const Input* settings = replay_->settings();
  if (!settings)
    return;
  options_.frame_id = settings->header.frame_id;
  options_.guide_delay = settings->values[0];
  options_.guide_delay_auto = settings->values[1] != 0.0;
  options_.live_guides = settings->values[2] != 0.0;
  options_.catch_up_time = settings->values[3];
  options_.catch_up_speed = settings->values[4];
}

/// Replaces ~scene and ~set by the recorded scene. The parameters may be left from an earlier start with another scene.
/// If they give the same scene they stay, because the files that a scene names are relative to its own file.
void SceneNode::takeRecordedScene()
{
  if (!options_.scene.empty())
    try
    {
      if (readScene(options_).source == replay_->scene())
        return;
    }
    catch (const SceneError&)
    {
      // The parameter gives no valid scene, so the recorded scene runs.
    }
  if (!options_.scene.empty() || !options_.overrides.empty())
    ROS_WARN(
        "%s: ~replay: %s was recorded with another scene (or other values of ~set) than the parameters give; the "
        "recorded scene runs%s%s",
        nh_priv_.getNamespace().c_str(), options_.replay.c_str(),
        options_.scene.empty() ? "" : leftover("scene").c_str(),
        options_.overrides.empty() ? "" : leftover("set").c_str());
  options_.scene = replay_->scene();
  options_.overrides.clear();
}

/// Returns advice for a parameter that an earlier start may have set, because ROS parameters outlive their node.
std::string SceneNode::leftover(const std::string& parameter) const
{
  return " (an earlier start may have left ~" + parameter + ": rosparam delete " + nh_priv_.resolveName(parameter) +
         ")";
}

void SceneNode::requireInput() const
{
  if (replay_)
    throw std::runtime_error("the node repeats the run in " + replay_->path() + " (~replay) and takes no other input");
}

/// `tick`: when it took effect. The first one is preceded by what replaying needs to know of the parameters.
void SceneNode::note(Input input, std::uint64_t tick)
{
  if (!bag_ || !options_.record_inputs || replay_)
    return;
  if (inputs_noted_ == 0 && input.kind != Input::SETTINGS)
    note(
        makeInput(Input::SETTINGS, {options_.guide_delay, options_.guide_delay_auto ? 1.0 : 0.0,
                                    options_.live_guides ? 1.0 : 0.0, options_.catch_up_time, options_.catch_up_speed}),
        tick);
  input.header = makeHeader(clock_.stamp(), options_.frame_id);
  input.number = inputs_noted_++;
  input.tick = tick;
  writeBag([&input](BagRecorder& bag) { bag.recordInput(input); });
}

void SceneNode::goOnAfter(Input input, Mode mode)
{
  const bool failed = mode_ == Mode::failed;
  if (failed)
    mode_ = mode;
  failure_.clear();
  const std::uint64_t tick = clock_.ticks();
  input.values = {static_cast<double>(jumped()), failed && guides_led_on_ ? 1.0 : 0.0};
  note(std::move(input), tick);
}

void SceneNode::noteGrasp(const SetGrasp::Request& request, const std::string& why)
{
  Input input =
      makeInput(Input::SET_GRASP, {static_cast<double>(request.action), static_cast<double>(request.first_node),
                                   static_cast<double>(request.last_node), request.point.x, request.point.y,
                                   request.point.z, request.max_distance, request.position_only ? 1.0 : 0.0});
  input.text = why;
  input.name = request.name;
  note(std::move(input), clock_.ticks());
}

bool SceneNode::replayInputs()
{
  try
  {
    while (const Input* input = replay_->next(clock_.ticks()))
    {
      if (bag_ && options_.record_inputs)   // the same bag again
        bag_->recordInput(*input);
      repeat(*input);
    }
  }
  catch (const std::exception& e)
  {
    fail("~replay: " + replay_->path() + ": " + e.what());
    return false;
  }
  finished_ = finished_ || clock_.seconds() > clock_.secondsAt(replay_->end()) - 0.5 * clock_.step();
  return !finished_;
}

void SceneNode::repeat(const Input& input)
{
  switch (input.kind)
  {
    case Input::SETTINGS: return;
    case Input::RESET:
    case Input::LOAD: return repeatJump(input);
    case Input::SET_GRASP: return repeatGrasp(input);
    case Input::SET_FUNCTIONS:
    {
      slender_sim::SetFunctions::Request request;
      request.name = input.name;
      request.set = input.text;
      request.blend = values(input, 1)[0];
      return setFunctions(request);
    }
    case Input::SPAWN:
    case Input::REMOVE:
    case Input::ATTACH:
    case Input::DETACH:
    case Input::SET_PARAMETER: return repeatEdit(input);
    case Input::GO_ON: return letInputsGoOn();
    case Input::SKIP: skip(static_cast<std::uint64_t>(values(input, 1)[0])); return anchor();
    default: inputs_->repeat(input);
  }
}

void SceneNode::repeatJump(const Input& input)
{
  if (values(input, 2)[1] != 0.0)   // the step that failed had led the guides on
  {
    simulation_->defaultInputs(step_inputs_);
    inputs_->apply(clock_.seconds() + clock_.step(), step_inputs_);
  }
  if (input.kind == Input::RESET)
  {
    simulation_->reset();
    inputs_->restart(*simulation_);
  }
  else
  {
    const std::filesystem::path file =
        std::filesystem::temp_directory_path() /
        ("slender_sim_replay_" + std::to_string(::getpid()) + "_" + std::to_string(input.number));
    std::ofstream(file, std::ios::binary)
        .write(reinterpret_cast<const char*>(input.data.data()), static_cast<std::streamsize>(input.data.size()));
    try
    {
      simulation_->load(file.string());
    }
    catch (...)
    {
      std::filesystem::remove(file);
      throw;
    }
    std::filesystem::remove(file);
    inputs_->attachAll(*simulation_);
  }
  jumped();
  skip(static_cast<std::uint64_t>(input.values[0]));
  anchor();
  publishState();
}

void SceneNode::repeatGrasp(const Input& input)
{
  const std::vector<double>& v = values(input, 8);
  const auto named = std::find(topics_->grasps.begin(), topics_->grasps.end(), input.name);
  if (input.text == kByLimit && named != topics_->grasps.end() &&
      !simulation_->grasps().isActive(static_cast<int>(named - topics_->grasps.begin())))
    return;   // the same limit has already released this grasp in the repeated run
  SetGrasp::Request request;
  SetGrasp::Response response;
  request.name = input.name;
  request.action = static_cast<std::uint8_t>(v[0]);
  request.first_node = static_cast<std::int32_t>(v[1]);
  request.last_node = static_cast<std::int32_t>(v[2]);
  request.point.x = v[3];
  request.point.y = v[4];
  request.point.z = v[5];
  request.max_distance = v[6];
  request.position_only = v[7] != 0.0;
  setGrasp(request, response);
}

}   // namespace slender
