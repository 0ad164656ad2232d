#include "slender_sim/node/bag_recorder.h"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <stdexcept>

#include <rosbag/bag.h>
#include <std_msgs/String.h>

#include "slender_sim/node/bag_paths.h"
#include "slender_sim/node/sim_clock.h"
#include "slender_sim/scene/file_paths.h"

namespace slender {

BagRecorder::BagRecorder(const std::string& path, const std::string& topic_namespace, const Simulation& simulation)
  : prefix_(topic_namespace.empty() || topic_namespace.back() != '/' ? topic_namespace + "/" : topic_namespace),
    topics_(simulation)
{
  for (const std::string& read : simulation.config().guide_bags)
    requireOtherBag(path, read, "a guide of the scene");
  try
  {
    if (const auto folder = std::filesystem::path(path).parent_path(); !folder.empty())
      makeFolder(folder);
    path_ = replaceablePath(path);
    const std::string active = replaceablePath(path_ + ".active");
    keepEarlierBags(active);
    bag_ = std::make_unique<rosbag::Bag>(active, rosbag::bagmode::Write);
  }
  catch (const std::exception& e)   // rosbag's, and a path that must not be replaced
  {
    throw std::runtime_error("bag " + path + ": cannot be written: " + e.what());
  }
  open_ = true;
}

BagRecorder::~BagRecorder()
{
  try
  {
    close();
  }
  catch (const std::exception&)
  {
    // close() is there for those who want to know
  }
}

/// Renames older bags, so that no bag is lost if a parameter of an earlier start still names it.
void BagRecorder::keepEarlierBags(const std::string& active)
{
  const std::string previous = replaceablePath(previousBag(path_)), unfinished = replaceablePath(previous + ".active");
  const auto keep = [this](const std::string& what, const std::string& as) {
    notes_.push_back("bag " + what + " is kept as " + as +
                     (std::filesystem::exists(as) ? ", in place of the one that is there" : ""));
  };
  if (std::filesystem::exists(path_))
    keep(path_ + " exists already; when the new one is complete, the old one", previous);
  if (!std::filesystem::exists(active))
    return;
  keep(active + " was left by a run that did not end properly; it", unfinished);
  std::filesystem::rename(active, unfinished);
}

/// What a failure leaves behind.
std::string BagRecorder::remains() const
{
  return "; what came before is in " + path_ + ".active (rosbag reindex reads it)";
}

template <class Message>
void BagRecorder::write(const std::string& topic, const ros::Time& stamp, const Message& message)
{
  try
  {
    bag_->write(prefix_ + topic, stamp, message);
  }
  catch (const rosbag::BagException& e)
  {
    throw WriteError("bag " + path_ + ": " + e.what() + remains());
  }
}

void BagRecorder::recordScene(const std::string& yaml, const ros::Time& stamp)
{
  std_msgs::String message;
  message.data = yaml;
  write("scene", stamp, message);
}

void BagRecorder::recordMesh(const slender_sim::MeshStamped& mesh)
{
  write(topics_.cloths + "mesh", mesh.header.stamp, mesh);
}

void BagRecorder::recordInput(const slender_sim::Input& input) { write("inputs", input.header.stamp, input); }

void BagRecorder::record(const SceneMessages& messages)
{
  for (const auto& state : messages.states)
    write(topics_.rods + "state", state->header.stamp, *state);
  for (const auto& state : messages.threads)
    write(topics_.threads + "state", state->header.stamp, *state);
  if (!messages.cloth_state->names.empty())
    write(topics_.cloths + "state", messages.cloth_state->header.stamp, *messages.cloth_state);
  for (std::size_t g = 0; g < messages.wrenches.size(); ++g)
    write("grasps/" + topics_.grasps[g] + "/wrench", messages.wrenches[g].header.stamp, messages.wrenches[g]);
  if (!messages.bodies.name.empty())
    write("body_states", messages.bodies.header.stamp, messages.bodies);
  for (std::size_t k = 0; k < messages.nozzles.size(); ++k)
    write(topics_.nozzles[k] + "nozzle/wrench", messages.nozzles[k].header.stamp, messages.nozzles[k]);
  if (!messages.grasps.name.empty())
    write("grasp_states", messages.grasps.header.stamp, messages.grasps);
  if (!messages.obstacles.name.empty())
    write("obstacle_states", messages.obstacles.header.stamp, messages.obstacles);
  if (!messages.fields.tables.empty())
    write("fields", messages.fields.header.stamp, messages.fields);
}

void BagRecorder::close()
{
  if (!open_)
    return;
  open_ = false;
  try
  {
    bag_->close();
  }
  catch (const rosbag::BagException& e)
  {
    (void)bag_.release();   // its destructor would try again, and end the program
    throw WriteError("bag " + path_ + ": " + e.what() + remains());
  }
  const std::string previous = previousBag(path_);
  if (std::filesystem::exists(path_) && std::rename(path_.c_str(), previous.c_str()) != 0)
  {
    throw WriteError("bag " + path_ + ": the old one cannot be renamed to " + previous + ": " + std::strerror(errno) +
                     remains());
  }
  if (std::rename((path_ + ".active").c_str(), path_.c_str()) != 0)
    throw WriteError("bag " + path_ + ": cannot be renamed from " + path_ + ".active: " + std::strerror(errno));
}

namespace {

class SimulationBag final : public Recorder
{
public:
  explicit SimulationBag(const std::string& path) : path_(path) {}

  void record(const Simulation& simulation, const StepReport&) override
  {
    SimClock clock(ros::Time(1.0), simulation.config().time.step);
    clock.skip(simulation.state().steps);
    if (!bag_)
    {
      bag_ = std::make_unique<BagRecorder>(path_, "/", simulation);
      for (const std::string& note : bag_->notes())
        std::fprintf(stderr, "simulate: warning: %s\n", note.c_str());
      bag_->recordScene(simulation.config().source, clock.stamp());
      if (!simulation.config().cloths.empty())
        bag_->recordMesh(clothMesh(simulation, clock.stamp(), "world"));
    }
    messages_.fill(simulation, clock.stamp(), "world", 0);
    messages_.fillFields(simulation);
    bag_->record(messages_);
  }

  void finish() override
  {
    if (bag_)
      bag_->close();
  }

private:
  std::string path_;
  std::unique_ptr<BagRecorder> bag_;
  SceneMessages messages_;
};

}   // namespace

std::unique_ptr<Recorder> makeBagRecorder(const std::string& path) { return std::make_unique<SimulationBag>(path); }

}   // namespace slender
