// Services that change the scene while it runs.
#include <algorithm>
#include <set>
#include <stdexcept>
#include <utility>

#include <std_msgs/String.h>

#include "slender_sim/node/converters.h"
#include "slender_sim/node/scene_markers.h"
#include "slender_sim/node/scene_node.h"

namespace slender {
namespace {

using slender_sim::Input;

/// The services that edit, and their numbers in the inputs of a bag.
struct EditService
{
  const char* name;
  SceneEdit::Kind kind;
  std::uint8_t number;
};
constexpr EditService edit_services[] = {{"spawn", SceneEdit::Kind::spawn, Input::SPAWN},
                                         {"remove", SceneEdit::Kind::remove, Input::REMOVE},
                                         {"attach", SceneEdit::Kind::attach, Input::ATTACH},
                                         {"detach", SceneEdit::Kind::detach, Input::DETACH},
                                         {"set_parameter", SceneEdit::Kind::set_parameter, Input::SET_PARAMETER}};

/// Rearranges the values of grasps for the edited scene. A grasp that still exists keeps its value.
void takeByName(const std::vector<std::string>& before, const std::vector<std::string>& now,
                std::vector<double>& values)
{
  std::vector<double> taken(now.size(), 0.0);
  for (std::size_t g = 0; g < now.size(); ++g)
    for (std::size_t old = 0; old < std::min(before.size(), values.size()); ++old)
      if (before[old] == now[g])
        taken[g] = values[old];
  values = std::move(taken);
}

/// Returns a warning without its file and line, because an edit changes these.
std::string withoutPlace(const SceneConfig& scene, const std::string& warning)
{
  const auto end = warning.compare(0, scene.file.size(), scene.file) == 0 ? warning.find(": ", scene.file.size())
                                                                          : std::string::npos;
  return end == std::string::npos ? warning : warning.substr(end);
}

}   // namespace

void SceneNode::advertiseEdits()
{
  using slender_sim::EditScene;
  for (const EditService& service : edit_services)
    offer<EditScene>(service.name,
                     [service](SceneNode* node, const EditScene::Request& request, EditScene::Response& response) {
                       Input input = makeInput(service.number);
                       input.text = request.text;
                       response.message = node->edit(service.kind, std::move(input));
                     });
}

std::string SceneNode::edit(SceneEdit::Kind kind, Input input)
{
  requireInput();
  if (!limits_->held().empty())
    throw std::runtime_error("inputs are held by a limit; call ~pause with false first");
  if (mode_ == Mode::failed)
    throw std::runtime_error("stopped at " + failure_ + "; call ~reset or ~load_state first");
  queue_.callAvailable();   // messages that came before the edit apply to the scene before the edit
  EditedScene scene = edited({kind, input.text});
  const std::string warnings = scene.warnings;
  note(std::move(input), clock_.ticks());
  takeUp(std::move(scene));
  return warnings;
}

SceneNode::EditedScene SceneNode::edited(const SceneEdit& edit) const
{
  EditedScene out;
  out.simulation = editedSimulation(*simulation_, edit);
  checkKind(out.simulation->config(), options_, kind_);
  out.topics = std::make_unique<SceneTopics>(*out.simulation);
  refuseLoops(*out.simulation, *out.topics);
  std::set<std::string> known;
  for (const std::string& warning : simulation_->config().warnings)
    known.insert(withoutPlace(simulation_->config(), warning));
  for (const std::string& warning : out.simulation->config().warnings)
    if (!known.count(withoutPlace(out.simulation->config(), warning)))
      out.warnings += (out.warnings.empty() ? "" : "\n") + warning;
  return out;
}

/// Replaces the scene by the edited one in all parts of the node.
void SceneNode::takeUp(EditedScene edited)
{
  if (!edited.warnings.empty())
    ROS_WARN("%s", edited.warnings.c_str());
  for (RunStatistics* statistics : {&total_, &recent_})
  {
    takeByName(topics_->grasps, edited.topics->grasps, statistics->max_force);
    takeByName(topics_->grasps, edited.topics->grasps, statistics->max_torque);
  }
  // Topics in both scenes keep their connections as long as the old publishers exist.
  const std::unique_ptr<GraspWrenches> wrenches_before = std::move(wrenches_);
  const std::unique_ptr<FrameBroadcaster> frames_before = std::move(frames_);
  std::swap(simulation_, edited.simulation);   // inputs_ refers to the old simulation until makeInputs()
  topics_ = std::move(edited.topics);
  limits_ = std::make_unique<LimitWatch>(*simulation_);
  crossings_ = std::make_unique<CrossingWatch>(*simulation_);
  makeInputs();
  {
    const Publishers before = std::exchange(pubs_, Publishers());
    advertise();
  }
  wrenches_->takeOver(*wrenches_before);
  std_msgs::String scene;
  scene.data = simulation_->config().source;
  pubs_.scene.publish(scene);
  writeBag([&](BagRecorder& bag) {
    bag.sceneChanged(*simulation_);
    bag.recordScene(scene.data, clock_.stamp());
  });
  if (topics_->has_cloths)
    publishMesh();
  options_.markers.letters = 0.0;   // The next picture chooses them for the edited scene.
  deleteMarkers(*edited.simulation);
  drawn_.reset();
}

/// Deletes the markers of objects that the edit removed.
void SceneNode::deleteMarkers(const Simulation& before)
{
  if (pubs_.markers.getNumSubscribers() == 0)
    return;
  const std_msgs::Header header = makeHeader(clock_.stamp(), options_.frame_id);
  using Id = std::pair<std::string, int>;
  std::set<Id> now;
  for (const visualization_msgs::Marker& marker : sceneMarkers(*simulation_, header, options_.markers).markers)
    now.insert(Id(marker.ns, marker.id));
  visualization_msgs::MarkerArray gone;
  for (const visualization_msgs::Marker& marker : sceneMarkers(before, header, options_.markers).markers)
  {
    if (now.count(Id(marker.ns, marker.id)))
      continue;
    gone.markers.emplace_back();
    gone.markers.back().header = header;
    gone.markers.back().ns = marker.ns;
    gone.markers.back().id = marker.id;
    gone.markers.back().action = visualization_msgs::Marker::DELETE;
  }
  if (!gone.markers.empty())
    pubs_.markers.publish(gone);
}

void SceneNode::repeatEdit(const Input& input)
{
  for (const EditService& service : edit_services)
    if (service.number == input.kind)
      takeUp(edited({service.kind, input.text}));
}

}   // namespace slender
