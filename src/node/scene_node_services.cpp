#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>

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

}   // namespace

void SceneNode::advertiseServices()
{
  services_ = {nh_priv_.advertiseService("pause", &SceneNode::onPause, this),
               nh_priv_.advertiseService("reset", &SceneNode::onReset, this),
               nh_priv_.advertiseService("step", &SceneNode::onStep, this),
               nh_priv_.advertiseService("save_state", &SceneNode::onSave, this),
               nh_priv_.advertiseService("load_state", &SceneNode::onLoad, this)};
  advertiseEdits();
  services_.push_back(nh_priv_.advertiseService("set_grasp", &SceneNode::onSetGrasp, this));
  if (tracksGuide(simulation_->config().cloths))
    services_.push_back(nh_priv_.advertiseService("set_functions", &SceneNode::onSetFunctions, this));
}

bool SceneNode::onPause(std_srvs::SetBool::Request& request, std_srvs::SetBool::Response& response)
{
  if (mode_ == Mode::failed)
  {
    response.success = false;
    response.message = "stopped at " + failure_ + "; call ~reset first";
    return true;
  }
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
  response.success = true;
  response.message = request.data ? "paused" : "running";
  return true;
}

bool SceneNode::onReset(std_srvs::Trigger::Request&, std_srvs::Trigger::Response& response)
{
  response.success = false;
  response.message = refusesInput();
  if (!response.message.empty())
    return true;
  queue_.callAvailable();   // older than the reset
  try
  {
    simulation_->reset();
  }
  catch (const SceneError& e)   // possible only after edits
  {
    response.message = e.what();
    return true;
  }
  inputs_->restart(*simulation_);
  goOnAfter(makeInput(slender_sim::Input::RESET), mode_before_failure_);
  publishState();
  inputs_since_ = clock_.seconds();
  publishDiagnostics();
  response.success = true;
  response.message = "epoch " + std::to_string(epoch_);
  return true;
}

bool SceneNode::onStep(slender_sim::Step::Request& request, slender_sim::Step::Response& response)
{
  response.success = false;
  if (mode_ == Mode::failed)
    response.message = "stopped at " + failure_ + "; call ~reset first";
  else if (options_.pace != Pace::step && mode_ != Mode::paused)
    response.message =
        std::string("the node runs by itself (~pace: ") + toString(options_.pace) + "); call ~pause first";
  else if (request.n == 0)
    response.message = "n must be at least 1";
  else if (stepping_)
    response.message = "another call of ~step is under way; wait, or end it with ~pause";
  else
  {
    queue_.callAvailable();   // what came before counts, what comes meanwhile does not
    inputs_->processPending();
    inputs_->takeKept(false);
    stepping_ = true;
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
    stepping_ = false;
    response.success = done == request.n;
    if (!response.success)
      response.message = "took " + std::to_string(done) + " of " + std::to_string(request.n) + " steps; " +
                         (!failure_.empty()      ? failure_
                          : !step_ended_.empty() ? step_ended_
                                                 : "the node ends");
  }
  response.step = simulation_->state().steps;
  response.stamp = clock_.stamp();
  return true;
}

bool SceneNode::onSetGrasp(slender_sim::SetGrasp::Request& request, slender_sim::SetGrasp::Response& response)
{
  response.first_node = response.last_node = -1;
  response.message = refusesInput();
  if (response.message.empty())
    setGrasp(request, response);
  if (response.success)
    noteGrasp(request);
  return true;
}

void SceneNode::setGrasp(const slender_sim::SetGrasp::Request& request, slender_sim::SetGrasp::Response& response)
{
  const auto found = std::find(topics_->grasps.begin(), topics_->grasps.end(), request.name);
  response.success = false;
  response.first_node = response.last_node = -1;
  if (found == topics_->grasps.end())
  {
    response.message = "no grasp \"" + request.name + "\"; the scene has" +
                       (topics_->grasps.empty() ? " none: give it grasps: {NAME: {...}}" : ":");
    for (const std::string& name : topics_->grasps)
      response.message += " " + name;
    return;
  }
  const int g = static_cast<int>(found - topics_->grasps.begin());
  const bool active = simulation_->grasps().isActive(g);
  if (request.action == slender_sim::SetGrasp::Request::RELEASE)
  {
    if (!active)
      response.message = request.name + " holds nothing";
    else
    {
      simulation_->grasps().release(g);
      showHandles();
    }
    response.success = active;
    return;
  }
  if (active)
    response.message = request.name + " holds " + simulation_->grasps().heldObject(g) + " already; release it first";
  else
    response.message = attach(request, g, response);
  response.success = response.message.empty();
}

bool SceneNode::onSetFunctions(slender_sim::SetFunctions::Request& request,
                               slender_sim::SetFunctions::Response& response)
{
  response.message = refusesInput();
  if (response.message.empty())
    setFunctions(request, response);
  if (!response.success)
    return true;
  slender_sim::Input input = makeInput(slender_sim::Input::SET_FUNCTIONS, {request.blend});
  input.name = request.name;
  input.text = request.set;
  note(std::move(input), clock_.ticks());
  return true;
}

void SceneNode::setFunctions(const slender_sim::SetFunctions::Request& request,
                             slender_sim::SetFunctions::Response& response)
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
  response.success = false;
  if (found < 0)
    response.message = "no tracked cloth \"" + request.name + "\"; the scene has:" + names;
  else if (request.name.empty() && tracked > 1)
    response.message = "name is empty; the scene has:" + names;
  else
    try
    {
      simulation_->setFunctions(found, request.set,
                                request.blend < 0 ? std::nullopt : std::optional<double>(request.blend));
      response.success = true;
    }
    catch (const std::invalid_argument& e)
    {
      response.message = e.what();
    }
}

/// Returns why not; empty when done.
std::string SceneNode::attach(const slender_sim::SetGrasp::Request& request, int grasp,
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
      return "nodes " + std::to_string(request.first_node) + " .. " + std::to_string(request.last_node) +
             ": must be in order and within " + std::to_string(-nodes) + " .. " + std::to_string(nodes - 1);
  }
  else if (request.action == slender_sim::SetGrasp::Request::ATTACH_NEAREST ||
           (cloth && request.action == slender_sim::SetGrasp::Request::ATTACH_WITHIN))
  {
    const Eigen::Vector3d point = fromMessage(request.point);
    if (!point.allFinite() || !std::isfinite(request.max_distance) || request.max_distance < 0.0)
      return "point must be finite, max_distance finite and not negative";
    const Eigen::VectorXd distances = (x.colwise() - point).colwise().norm();
    const double distance = distances.minCoeff(&first);
    const bool all = request.action == slender_sim::SetGrasp::Request::ATTACH_WITHIN;
    last = first;
    if ((all || request.max_distance > 0.0) && distance > request.max_distance)
      return "the nearest node " + std::to_string(first) + " is " + std::to_string(distance) + " m away";
    for (int i = 0; all && i < nodes; ++i)
      if (distances[i] <= request.max_distance)
        within.push_back(i);
    if (all)
      first = within.front(), last = within.back();
  }
  else
    return "action " + std::to_string(request.action) + ": must be RELEASE, ATTACH_NODES" +
           (cloth ? ", ATTACH_NEAREST or ATTACH_WITHIN" : " or ATTACH_NEAREST");
  if (request.position_only && cloth)
    return "position_only is for rods; a cloth's vertices have no frames";
  if (request.position_only && first != last)
    return "position_only holds a single node: first_node must be last_node";
  try
  {
    if (!within.empty())
      simulation_->grasps().attachVertices(grasp, within);
    else
      simulation_->grasps().attach(grasp, first, last, request.position_only ? Hold::position : Hold::frame);
  }
  catch (const std::exception& e)
  {
    return e.what();
  }
  inputs_->attachAt(grasp, simulation_->grasps().pose(grasp));
  showHandles();
  response.first_node = first;
  response.last_node = last;
  return "";
}

bool SceneNode::onSave(slender_sim::FilePath::Request& request, slender_sim::FilePath::Response& response)
{
  response.success = false;
  if (request.path.empty())
    response.message = "path is empty";
  else
    try
    {
      const std::string path = wholePath(request.path);
      simulation_->save(path);
      response.success = true;
      response.message = "saved " + path;
    }
    catch (const std::exception& e)
    {
      response.message = e.what();
    }
  return true;
}

bool SceneNode::onLoad(slender_sim::FilePath::Request& request, slender_sim::FilePath::Response& response)
{
  response.success = false;
  response.message = refusesInput();
  if (!response.message.empty())
    return true;
  queue_.callAvailable();   // older than the state that takes over
  slender_sim::Input input = makeInput(slender_sim::Input::LOAD);
  const std::string path = wholePath(request.path);
  try
  {
    simulation_->load(path);
    std::ifstream file(path, std::ios::binary);
    if (bag_ && options_.record_inputs)
      input.data.assign(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>());
  }
  catch (const std::exception& e)
  {
    response.message = request.path.empty() ? "path is empty" : e.what();
    return true;
  }
  inputs_->attachAll(*simulation_);
  goOnAfter(std::move(input), Mode::paused);   // what was loaded may be just before the failure
  inputs_->takeKept(true);                     // the clock is at the present
  publishState();
  response.success = true;
  response.message = "loaded " + path;
  return true;
}

}   // namespace slender
