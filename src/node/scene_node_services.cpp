#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <stdexcept>

#include "slender_sim/node/converters.h"
#include "slender_sim/node/scene_node.h"
#include "slender_sim/scene/reader.h"

namespace slender {
namespace {

/// Returns the absolute path. A relative path starts at the node's working directory, which callers of a service do not
/// know.
std::string wholePath(const std::string& path)
{
  std::error_code error;
  const std::filesystem::path whole = std::filesystem::absolute(path, error);
  return error || path.empty() ? path : whole.lexically_normal().string();
}

/// The flag is true for as long as this object exists.
struct Raised
{
  explicit Raised(bool& the_flag) : flag(the_flag) { flag = true; }
  Raised(const Raised&) = delete;
  ~Raised() { flag = false; }
  bool& flag;
};

}   // namespace

void SceneNode::advertiseServices()
{
  offer<std_srvs::SetBool>("pause", &SceneNode::onPause);
  offer<std_srvs::Trigger>("reset", &SceneNode::onReset);
  offer<slender_sim::Step>("step", &SceneNode::onStep);
  offer<slender_sim::FilePath>("save_state", &SceneNode::onSave);
  offer<slender_sim::FilePath>("load_state", &SceneNode::onLoad);
  advertiseEdits();
  offer<slender_sim::SetGrasp>("set_grasp", &SceneNode::onSetGrasp);
  if (tracksGuide(simulation_->config().cloths))
    offer<slender_sim::SetFunctions>("set_functions", &SceneNode::onSetFunctions);
}

void SceneNode::onPause(const std_srvs::SetBool::Request& request, std_srvs::SetBool::Response& response)
{
  if (mode_ == Mode::failed)
    throw std::runtime_error("stopped at " + failure_ + "; call ~reset first");
  if (!request.data && mode_ == Mode::paused)
  {
    skipToPresent();
    inputs_->takeKept(true);
  }
  if (!request.data && !limits_->held().empty())
  {
    letInputsGoOn();
    note(makeInput(slender_sim::Input::GO_ON), clock_.ticks());
  }
  mode_ = request.data ? Mode::paused : Mode::running;
  step_ended_ = "~pause was called";
  response.message = request.data ? "paused" : "running";
}

void SceneNode::onReset(const std_srvs::Trigger::Request&, std_srvs::Trigger::Response& response)
{
  requireInput();
  queue_.callAvailable();   // older than the reset
  simulation_->reset();     // throws SceneError, which is possible only after edits
  inputs_->restart(*simulation_);
  goOnAfter(makeInput(slender_sim::Input::RESET), mode_before_failure_);
  publishState();
  inputs_since_ = clock_.seconds();
  publishDiagnostics();
  response.message = "epoch " + std::to_string(epoch_);
}

void SceneNode::onStep(const slender_sim::Step::Request& request, slender_sim::Step::Response& response)
{
  const auto tellPlace = [&] {
    response.step = simulation_->state().steps;
    response.stamp = clock_.stamp();
  };
  tellPlace();
  if (mode_ == Mode::failed)
    throw std::runtime_error("stopped at " + failure_ + "; call ~reset first");
  if (options_.pace != Pace::step && mode_ != Mode::paused)
    throw std::runtime_error(std::string("the node runs by itself (~pace: ") + toString(options_.pace) +
                             "); call ~pause first");
  if (request.n == 0)
    throw std::runtime_error("n must be at least 1");
  if (stepping_)
    throw std::runtime_error("another call of ~step is under way; wait, or end it with ~pause");
  queue_.callAvailable();   // what came before counts, what comes meanwhile does not
  inputs_->processPending();
  inputs_->takeKept(false);
  const Raised stepping(stepping_);
  step_ended_.clear();
  ros::WallTime looked = ros::WallTime::now();
  std::uint32_t done = 0;
  while (done < request.n && !ended() && step_ended_.empty() && advance())
  {
    ++done;
    tell();
    if ((ros::WallTime::now() - looked).toSec() < kBurst)
      continue;
    while (!ended() && step_ended_.empty() && services_queue_.callOne() == ros::CallbackQueue::Called)
      continue;
    looked = ros::WallTime::now();
  }
  tellPlace();
  if (done < request.n)
    throw std::runtime_error("took " + std::to_string(done) + " of " + std::to_string(request.n) + " steps; " +
                             (!failure_.empty()      ? failure_
                              : !step_ended_.empty() ? step_ended_
                                                     : "the node ends"));
}

void SceneNode::onSetGrasp(const slender_sim::SetGrasp::Request& request, slender_sim::SetGrasp::Response& response)
{
  response.first_node = response.last_node = -1;
  requireInput();
  setGrasp(request, response);
  noteGrasp(request);
}

void SceneNode::setGrasp(const slender_sim::SetGrasp::Request& request, slender_sim::SetGrasp::Response& response)
{
  const auto found = std::find(topics_->grasps.begin(), topics_->grasps.end(), request.name);
  if (found == topics_->grasps.end())
  {
    std::string names = topics_->grasps.empty() ? " none: give it grasps: {NAME: {...}}" : ":";
    for (const std::string& name : topics_->grasps)
      names += " " + name;
    throw std::runtime_error("no grasp \"" + request.name + "\"; the scene has" + names);
  }
  const int g = static_cast<int>(found - topics_->grasps.begin());
  const bool active = simulation_->grasps().isActive(g),
             release = request.action == slender_sim::SetGrasp::Request::RELEASE;
  if (release && !active)
    throw std::runtime_error(request.name + " holds nothing");
  if (!release && active)
    throw std::runtime_error(request.name + " holds " + simulation_->grasps().heldObject(g) +
                             " already; release it first");
  if (release)
    simulation_->grasps().release(g);
  else
    attach(request, g, response);
  showHandles();
}

void SceneNode::onSetFunctions(const slender_sim::SetFunctions::Request& request, slender_sim::SetFunctions::Response&)
{
  requireInput();
  setFunctions(request);
  slender_sim::Input input = makeInput(slender_sim::Input::SET_FUNCTIONS, {request.blend});
  input.name = request.name;
  input.text = request.set;
  note(std::move(input), clock_.ticks());
}

void SceneNode::setFunctions(const slender_sim::SetFunctions::Request& request)
{
  std::string names;
  int found = -1, tracked = 0;
  for (const auto& [object, name, tracking] : simulation_->guides())
    if (object.isCloth())
    {
      names += " " + name;
      if (name == request.name || (request.name.empty() && tracked == 0))
        found = object.index;
      ++tracked;
    }
  if (found < 0)
    throw std::runtime_error("no tracked cloth \"" + request.name + "\"; the scene has:" + names);
  if (request.name.empty() && tracked > 1)
    throw std::runtime_error("name is empty; the scene has:" + names);
  simulation_->setFunctions(found, request.set,
                            request.blend < 0 ? std::nullopt : std::optional<double>(request.blend));
}

void SceneNode::attach(const slender_sim::SetGrasp::Request& request, int grasp,
                       slender_sim::SetGrasp::Response& response)
{
  const ObjectRef& object = simulation_->grasps()[grasp].object;
  const bool cloth = object.isCloth();
  const Eigen::Matrix3Xd& x = simulation_->state().points(object);
  const int nodes = static_cast<int>(x.cols());
  std::vector<int> within;
  int first = request.first_node, last = request.last_node;
  if (request.action == slender_sim::SetGrasp::Request::ATTACH_NODES)
  {
    first += first < 0 ? nodes : 0;
    last += last < 0 ? nodes : 0;
    if (first < 0 || last >= nodes || first > last)
      throw std::runtime_error("nodes " + std::to_string(request.first_node) + " .. " +
                               std::to_string(request.last_node) + ": must be in order and within " +
                               std::to_string(-nodes) + " .. " + std::to_string(nodes - 1));
  }
  else if (request.action == slender_sim::SetGrasp::Request::ATTACH_NEAREST ||
           (cloth && request.action == slender_sim::SetGrasp::Request::ATTACH_WITHIN))
  {
    const Eigen::Vector3d point = fromMessage(request.point);
    if (!point.allFinite() || !std::isfinite(request.max_distance) || request.max_distance < 0.0)
      throw std::runtime_error("point must be finite, max_distance finite and not negative");
    const Eigen::VectorXd distances = (x.colwise() - point).colwise().norm();
    const double distance = distances.minCoeff(&first);
    const bool all = request.action == slender_sim::SetGrasp::Request::ATTACH_WITHIN;
    last = first;
    if ((all || request.max_distance > 0.0) && distance > request.max_distance)
      throw std::runtime_error("the nearest node " + std::to_string(first) + " is " + std::to_string(distance) +
                               " m away");
    for (int i = 0; all && i < nodes; ++i)
      if (distances[i] <= request.max_distance)
        within.push_back(i);
    if (all)
      first = within.front(), last = within.back();
  }
  else
    throw std::runtime_error("action " + std::to_string(request.action) + ": must be RELEASE, ATTACH_NODES" +
                             (cloth ? ", ATTACH_NEAREST or ATTACH_WITHIN" : " or ATTACH_NEAREST"));
  if (request.position_only && cloth)
    throw std::runtime_error("position_only is for rods; a cloth's vertices have no frames");
  if (request.position_only && first != last)
    throw std::runtime_error("position_only holds a single node: first_node must be last_node");
  if (!within.empty())
    simulation_->grasps().attachVertices(grasp, within);
  else
    simulation_->grasps().attach(grasp, first, last, request.position_only ? Hold::position : Hold::frame);
  inputs_->attachAt(grasp, simulation_->grasps().pose(grasp));
  response.first_node = first;
  response.last_node = last;
}

void SceneNode::onSave(const slender_sim::FilePath::Request& request, slender_sim::FilePath::Response& response)
{
  if (request.path.empty())
    throw std::runtime_error("path is empty");
  const std::string path = wholePath(request.path);
  simulation_->save(path);
  response.message = "saved " + path;
}

void SceneNode::onLoad(const slender_sim::FilePath::Request& request, slender_sim::FilePath::Response& response)
{
  requireInput();
  queue_.callAvailable();   // older than the state that takes over
  if (request.path.empty())
    throw std::runtime_error("path is empty");
  slender_sim::Input input = makeInput(slender_sim::Input::LOAD);
  const std::string path = wholePath(request.path);
  simulation_->load(path);
  std::ifstream file(path, std::ios::binary);
  if (bag_ && options_.record_inputs)
    input.data.assign(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>());
  inputs_->attachAll(*simulation_);
  goOnAfter(std::move(input), Mode::paused);   // what was loaded may be just before the failure
  inputs_->takeKept(true);                     // the clock is at the present
  publishState();
  response.message = "loaded " + path;
}

}   // namespace slender
