#include <algorithm>
#include <cmath>
#include <cstdio>

#include <diagnostic_msgs/DiagnosticStatus.h>

#include "scene/reader/yaml_cursor.h"
#include "slender_sim/node/scene_node.h"

namespace slender {
namespace {

using diagnostic_msgs::DiagnosticStatus;
using diagnostic_updater::DiagnosticStatusWrapper;

constexpr double kBehind = 1.0;   // [s] /clock may lag behind the simulated time by a few resets' ticks

std::string text(const char* format, double value)
{
  char out[128];
  std::snprintf(out, sizeof(out), format, value);
  return out;
}

void raise(DiagnosticStatusWrapper& status, std::uint8_t level, const std::string& message)
{
  if (level < status.level)
    return;
  status.message = level > status.level || status.message.empty() ? message : status.message + "; " + message;
  status.level = level;
}

void addThreads(const Simulation& simulation, const RunStatistics& recent, DiagnosticStatusWrapper& status)
{
  std::uint64_t nodes = 0, pieces = 0;
  ThreadVolumes volumes;
  for (const ThreadGroupState& group : simulation.state().threads)
  {
    volumes.add(group);
    for (const ThreadState& thread : group.threads)
    {
      nodes += static_cast<std::uint64_t>(thread.nodes());
      ++pieces;
    }
  }
  status.add("nodes", nodes);
  status.add("threads and pieces", pieces);
  status.add("fed volume [m^3]", volumes.fed);
  status.add("volume in the scene [m^3]", volumes.present);
  status.add("volume that left the region [m^3]", volumes.left);
  status.add("volume dropped by edges.deposited [m^3]", volumes.dropped);
  if (std::abs(volumes.missing()) > ThreadVolumes::kMostMissing)
    raise(status, DiagnosticStatus::ERROR, "fluid is missing: a defect of the program");
  status.add("mended folds", recent.mended_folds);
}

/// Of tracked cloths with several sets.
void addFunctions(const Simulation& simulation, const GuideRef& guide, DiagnosticStatusWrapper& status)
{
  if (guide.tracking->sets.size() < 2)
    return;
  const FunctionBlend& blend = simulation.state().guide(guide.object).blend;
  const double time = simulation.state().time;
  status.add("test functions of " + guide.name, simulation.functions(guide.object).name);
  status.add("blend of " + guide.name + " goes on for [s]",
             blend.active(time) ? blend.start + blend.duration - time : 0.0);
  status.add("blend of " + guide.name + " leaves at most [m]", blend.left(time));
}

/// How a run that begins in equilibrium began.
void addStart(const Simulation& simulation, DiagnosticStatusWrapper& status)
{
  if (const auto& start = simulation.startReport())
  {
    status.add("start: residual", start->residual);
    status.add("start: energy [J]", start->energy);
    status.add("start: lowest eigenvalue [1/s^2]", start->lowest_eigenvalue);
    status.add("start: stable", start->stable ? "yes" : "no");
    status.add("start: unstable equilibria left", start->escapes);
    if (!start->stable)
      raise(status, DiagnosticStatus::WARN, "the run started from an unstable equilibrium");
  }
}

/// How far shells and rods are from what they track.
void addTracking(const Simulation& simulation, const RunStatistics& recent, DiagnosticStatusWrapper& status)
{
  double error = 0.0, force = 0.0, refused = 0.0;
  bool bounded = false;
  for (const GuideRef& guide : simulation.guides())
  {
    const TrackingError now = simulation.trackingError(guide.object);
    error = std::max(error, now.met);
    refused = std::max(refused, now.at_bound);
    force = std::max(force, simulation.state().guide(guide.object).forces.colwise().norm().maxCoeff());
    bounded = bounded || guide.tracking->sets[0].bounds.size() > 0;
  }
  status.add("constraint residual [m]", error);
  status.add("worst constraint residual over size", recent.tracking_error);
  status.add("largest guide force [N]", force);
  for (const GuideRef& guide : simulation.guides())
    addFunctions(simulation, guide, status);
  if (bounded)
  {
    status.add("most guide forces at their bounds", recent.forces_at_bound);
    status.add("greatest distance where forces are at their bounds [m]", refused);
  }
}

void addCloths(const Simulation& simulation, const RunStatistics& recent, DiagnosticStatusWrapper& status)
{
  std::uint64_t vertices = 0;
  for (const ClothState& cloth : simulation.state().cloths)
    vertices += static_cast<std::uint64_t>(cloth.x.cols());
  status.add("vertices", vertices);
  const auto& cloths = simulation.config().cloths;
  if (std::any_of(cloths.begin(), cloths.end(), [](const ClothConfig& cloth) { return cloth.contact.has_value(); }))
  {
    status.add("contacts per step",
               recent.steps ? static_cast<double>(recent.repulsions) / static_cast<double>(recent.steps) : 0.0);
    status.add("collisions stopped", recent.impulses);
    status.add("rigid pieces", recent.zones);
  }
}

double energyOf(const Simulation& simulation)
{
  double energy = 0.0;
  for (std::size_t r = 0; r < simulation.state().rods.size(); ++r)
    energy += simulation.energies(static_cast<int>(r)).total();
  for (std::size_t k = 0; k < simulation.state().cloths.size(); ++k)
    energy += simulation.clothEnergies(static_cast<int>(k)).total();
  return energy;
}

}   // namespace

void SceneNode::publishDiagnostics()
{
  diagnostic_msgs::DiagnosticArray message;
  message.header.stamp = clock_.stamp();
  message.status = {simulationStatus(), inputStatus()};
  pubs_.diagnostics.publish(message);
  if (const std::string waits = clockWentBack(); !waits.empty() && ros::WallTime::now() >= next_clock_reminder_)
  {
    next_clock_reminder_ = ros::WallTime::now() + ros::WallDuration(kClockReminder);
    ROS_WARN("%s %s", nh_priv_.getNamespace().c_str(), waits.c_str());
  }
  remindOfInputs();
  if (const double wall = recent_.wallSeconds(); mode_ != Mode::running || recent_.steps == 0)
    shown_pace_ = 0.0;
  else if (wall > 0.0)
    shown_pace_ = recent_.simulated / wall;
  recent_ = RunStatistics();
  next_diagnostics_ = ros::WallTime::now() + ros::WallDuration(1.0 / options_.diagnostics_rate);
}

/// Returns a line of the legend, so that a slow simulation does not look as if it stood still.
std::string SceneNode::paceNote() const
{
  constexpr double kSlow = 0.9;   // share of real time below which the legend has this line
  if (mode_ == Mode::paused)
    return "paused";
  if (mode_ == Mode::failed)
    return "stopped: a step failed";
  return options_.pace != Pace::step && shown_pace_ > 0.0 && shown_pace_ < kSlow
             ? text("%.2g of real time", shown_pace_)
             : std::string();
}

void SceneNode::remindOfInputs()
{
  if (mode_ != Mode::running || replay_ || ros::WallTime::now() < next_input_reminder_)
    return;
  const std::string waits = joinWords(inputs_->unheardBodies());
  if (!waits.empty())
  {
    const std::string& stranger = inputs_->drops().last(Drop::unknown_name);
    ROS_WARN("%s: nobody has published a pose yet of %s; what follows it stays where it is (topic %s)%s%s",
             nh_priv_.getNamespace().c_str(), waits.c_str(), nh_.resolveName("bodies").c_str(),
             stranger.empty() ? "" : ". Messages there name others: ", stranger.c_str());
  }
  bool reminded = !waits.empty();
  if (!told_of_topics_ && total_.steps > 0 && total_.simulated > kClockReminder / 2)
  {
    told_of_topics_ = true;
    const std::string topics = joinWords(inputs_->unheardTopics());
    if (!topics.empty())
      ROS_INFO("%s: nobody has published a pose yet for %s; what follows it stays where it is",
               nh_priv_.getNamespace().c_str(), topics.c_str());
  }
  for (const TfInputs::State& frame : inputs_->frames())
  {
    if (frame.heard && !frame.stale)
      continue;
    ROS_WARN("%s: tf has no %s of the frame %s, which %s follows, and which stays where it is: %s",
             nh_priv_.getNamespace().c_str(), frame.heard ? "new pose" : "pose yet", frame.frame.c_str(),
             frame.who.c_str(), frame.why.c_str());
    reminded = true;
  }
  if (reminded)
    next_input_reminder_ = ros::WallTime::now() + ros::WallDuration(kClockReminder);
}

std::string SceneNode::clockWentBack() const
{
  const bool follows = mode_ == Mode::running && options_.pace == Pace::follow;
  const double behind = follows ? clock_.seconds() - clock_.secondsAt(ros::Time::now()) : 0.0;
  return behind > kBehind ? "waits for /clock, which is " + std::to_string(behind) +
                                " s behind the simulated time; start the node anew if it went back"
                          : "";
}

void SceneNode::addLimits(DiagnosticStatusWrapper& status) const
{
  const std::vector<std::string> lasting = limits_->lasting();
  if (!limits_->held().empty())
    status.mergeSummary(DiagnosticStatus::ERROR,
                        "inputs are held (call ~pause with false to let them go on): " + limits_->held());
  else if (!lasting.empty())
    status.mergeSummary(
        DiagnosticStatus::WARN,
        lasting.front() + (lasting.size() > 1 ? " and " + std::to_string(lasting.size() - 1) + " more limits" : ""));
  const std::vector<std::string>& inside = crossings_->heldInside();
  if (!inside.empty())
    status.mergeSummary(DiagnosticStatus::WARN, inside.front());
  for (const std::string& pair : inside)
    status.add("held inside", pair);
  status.add("limits exceeded now", lasting.size());
  status.add("limits exceeded so far", limits_->count());
  if (!lasting.empty())
    status.add("last limit exceeded", lasting.back());
}

DiagnosticStatusWrapper SceneNode::simulationStatus() const
{
  DiagnosticStatusWrapper status;
  status.name = nh_priv_.getNamespace() + ": simulation";
  status.hardware_id = simulation_->config().name;
  status.level = DiagnosticStatus::OK;

  const double wall = recent_.wallSeconds();
  const double achieved = wall > 0.0 ? recent_.simulated / wall : 0.0;
  const bool running = mode_ == Mode::running && options_.pace != Pace::step;
  if (running && options_.pace == Pace::wall && recent_.steps > 10 && recent_.realTimeFactor() < options_.speed)
    raise(status, DiagnosticStatus::WARN, options_.speed == 1.0 ? "slower than real time" : "slower than ~speed");
  if (recent_.skipped > 0.0)
    raise(status, DiagnosticStatus::WARN, text("the clock skipped %.3g s to the present (~max_lag)", recent_.skipped));
  if (const std::string waits = clockWentBack(); !waits.empty())
    raise(status, DiagnosticStatus::WARN, waits);
  if (recent_.cut_steps > 0)
    raise(status, DiagnosticStatus::WARN, "steps had to be cut");
  if (!bag_failure_.empty())
    raise(status, DiagnosticStatus::ERROR, "recording stopped: " + bag_failure_);
  if (mode_ == Mode::failed)
    raise(status, DiagnosticStatus::ERROR, "stopped at " + failure_ + "; waiting for ~reset");
  addLimits(status);
  if (status.message.empty())
    status.message = mode_ == Mode::paused ? "paused" : running ? "running" : "waiting for ~step";

  status.add("epoch", epoch_);
  status.add("step", simulation_->state().steps);
  status.add("simulated time [s]", simulation_->state().time);
  status.add("mean step time [ms]", recent_.steps ? 1e3 * recent_.busy / static_cast<double>(recent_.steps) : 0.0);
  status.add("longest step time [ms]", 1e3 * recent_.worst_step);
  status.add("real-time factor", recent_.realTimeFactor());
  status.add("simulated per wall second", achieved);
  if (options_.pace == Pace::wall || options_.pace == Pace::follow)
  {
    status.add("lag of stamps [s]", total_.stamp_lag);
    status.add("largest lag of stamps [s]", recent_.worst_stamp_lag);
  }
  if (options_.pace == Pace::wall)
    status.add("clock skipped [s]", total_.skipped);
  status.add("iterations per step",
             recent_.steps ? static_cast<double>(recent_.iterations) / static_cast<double>(recent_.steps) : 0.0);
  status.add("cut steps", recent_.cut_steps);
  status.add("residual", recent_.residual);
  status.add("largest strain", recent_.max_strain);
  addStart(*simulation_, status);
  if (topics_->has_threads)
    addThreads(*simulation_, recent_, status);
  if (recent_.projection_iterations > 0)
  {
    status.add("projection iterations", recent_.projection_iterations);
    status.add("constraint error", recent_.constraint_error);
  }
  if (!simulation_->guides().empty())
    addTracking(*simulation_, recent_, status);
  if (topics_->has_cloths)
    addCloths(*simulation_, recent_, status);
  if (topics_->has_rods || topics_->has_cloths)   // viscous threads keep no energy
    status.add("energy [J]", energyOf(*simulation_));
  status.add("recording", bag_ ? bag_->path() : bag_failure_.empty() ? std::string("no") : "stopped: " + bag_failure_);
  return status;
}

DiagnosticStatusWrapper SceneNode::inputStatus()
{
  DiagnosticStatusWrapper status;
  status.name = nh_priv_.getNamespace() + ": inputs";
  status.hardware_id = simulation_->config().name;
  status.level = DiagnosticStatus::OK;
  for (const GuideInputs::Age& age : inputs_->ages())
  {
    if (age.seconds)
      status.add("input age " + age.name + " [s]", *age.seconds);
    else
      status.add("input age " + age.name + " [s]", "none yet");
    if (age.seconds && *age.seconds > options_.guide_timeout && mode_ == Mode::running)
      raise(status, DiagnosticStatus::WARN, "no input for " + age.name);
    if (age.seconds)
      status.add("input lag " + age.name + " [s]", age.lag);
    if (age.seconds && age.late() > 0.0 && *age.seconds <= options_.guide_timeout)
      raise(status, DiagnosticStatus::WARN,
            "guides arrive " + text("%.0f ms later than ~guide_delay", 1e3 * age.late()) + " allows: " + age.name +
                text(" lags by %.3g s; raise ~guide_delay", age.lag) +
                (options_.pace == Pace::wall ? ", or set it to auto" : ""));
    const bool late = mode_ == Mode::running && clock_.seconds() - inputs_since_ > options_.guide_timeout;
    if (age.missing || (!age.seconds && late))
      raise(status, DiagnosticStatus::WARN, "no input yet for " + age.name);
  }
  for (const TfInputs::State& frame : inputs_->frames())
    if (!frame.why.empty())
      status.add("tf " + frame.frame, frame.why);
  const std::vector<GuideInputs::Setting> settings = inputs_->settings();
  for (const GuideInputs::Setting& setting : settings)
    status.add(setting.name, setting.value);
  const DropCounter& drops = inputs_->drops();
  if (drops.total() > reported_drops_)
    raise(status, DiagnosticStatus::WARN, "messages were dropped");
  reported_drops_ = drops.total();
  status.add("received", drops.received());
  status.add("dropped", drops.total());
  for (int r = 0; r < kDropReasons; ++r)
  {
    const Drop reason = static_cast<Drop>(r);
    status.add(std::string("dropped ") + toString(reason), drops.count(reason));
    if (!drops.last(reason).empty())
      status.add(std::string("last dropped ") + toString(reason), drops.last(reason));
  }
  if (status.message.empty())
    status.message = inputs_->ages().empty() && settings.empty() ? "nothing is driven from outside" : "ok";
  return status;
}

}   // namespace slender
