#include "slender_sim/node/bag_reader.h"

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <new>
#include <set>
#include <vector>

#include <ros/exception.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <std_msgs/String.h>

#include "scene/reader/yaml_cursor.h"
#include "slender_sim/Fields.h"
#include "slender_sim/node/converters.h"
#include "slender_sim/node/scene_messages.h"
#include "slender_sim/node/step_gaps.h"
#include "slender_sim/scene/file_paths.h"
#include "slender_sim/scene/reader.h"
#include "message_snapshots.h"

namespace slender {
namespace {

/// The shortest step [s] that explains so many nanoseconds in so many steps: stamps are rounded, scenes say 0.002.
double shortestStep(double span_ns, double steps)
{
  for (int digits = 1; digits < 17; ++digits)
  {
    const double step = std::strtod(shortNumber(1e-9 * span_ns / steps, digits).c_str(), nullptr);
    if (std::abs(1e9 * step * steps - span_ns) <= 1.0)
      return step;
  }
  return 1e-9 * span_ns / steps;
}

}   // namespace

/// The messages of one topic, in the order of their stamps.
class Stream
{
public:
  virtual ~Stream() = default;
  bool alive() const { return alive_; }
  const ros::Time& stamp() const { return stamp_; }
  /// Hands the current message over and goes on to the next one.
  virtual void take() = 0;
  virtual std::size_t size() = 0;   ///< number of messages

protected:
  bool alive_ = false;
  ros::Time stamp_;
};

template <class Message>
class TopicStream final : public Stream
{
public:
  TopicStream(const rosbag::Bag& bag, const std::string& topic, std::function<void(const Message&)> use)
    : use_(std::move(use)),
      topic_(topic),
      view_(bag,
            [topic](const rosbag::ConnectionInfo* c) {
              return c->topic == topic && c->datatype == ros::message_traits::datatype<Message>();
            }),
      at_(view_.begin())
  {
    load();
  }

  void take() override
  {
    use_(*message_);
    ++at_;
    load();
  }

  std::size_t size() override { return view_.size(); }

private:
  void load()
  {
    alive_ = at_ != view_.end();
    if (!alive_)
      return;
    message_ = at_->template instantiate<Message>();
    if (!message_)
      throw BagError(
          topic_ + ": its messages are of another version of slender_sim; export with the version that recorded them");
    stamp_ = message_->header.stamp;
  }

  std::function<void(const Message&)> use_;
  std::string topic_;
  rosbag::View view_;
  rosbag::View::iterator at_;
  boost::shared_ptr<Message> message_;
};

struct BagReader::Contents
{
  std::string path, prefix;
  rosbag::Bag bag;
  std::optional<SceneConfig> scene;
  std::string scene_problem;
  std::vector<slender_sim::MeshStamped> meshes;   ///< the initial meshes, and one entry per edit of the scene
  std::vector<std::unique_ptr<Stream>> streams;
  std::size_t messages = 0, done = 0;
  double step_length = 0.0;   ///< [s]; 0: one instant only
  std::optional<std::int64_t> first_stamp;
  std::int64_t stamp = 0;
  std::uint64_t step = 0;
  bool step_known = false;   ///< of this instant
  std::uint32_t epoch = 0;
  StepGaps gaps;

  SceneSnapshot* out = nullptr;        ///< the streams write to this snapshot
  std::vector<std::string> own_axes;   ///< grasps with a wrench in the grasp's frame at this instant

  void open();
  void choosePrefix(const std::string& topic_namespace);
  void readScene(const std::string& folder);
  void openStreams();
  void findStepLength();
  /// Adds a stream of the topic if its messages are of this type and `expected` tells that its name is right.
  template <class Message>
  void stream(const rosbag::ConnectionInfo& connection, bool expected, std::function<void(const Message&)> use)
  {
    if (!expected || connection.datatype != ros::message_traits::datatype<Message>())
      return;
    streams.push_back(std::make_unique<TopicStream<Message>>(bag, connection.topic, std::move(use)));
    messages += streams.back()->size();
  }
  void openStream(const rosbag::ConnectionInfo& connection, const std::string& name);
  GraspSnapshot& grasp(const std::string& name);
  void turnWrenches();
  /// Takes the step of a state of rods, threads or cloths.
  template <class Message>
  void takeStep(const Message& state)
  {
    step = state.step;
    epoch = state.epoch;
    step_known = true;
  }
};

void BagReader::Contents::open()
{
  namespace fs = std::filesystem;
  if (!fs::exists(path))
  {
    if (fs::exists(path + ".active"))
      throw BagError(path + ": is still being written to " + path +
                     ".active; wait for its recorder, or if that has died: rosbag reindex " + path + ".active");
    throw BagError(path + ": there is no such file");
  }
  try
  {
    requireRegularFile(path);
    bag.open(path, rosbag::bagmode::Read);
  }
  catch (const rosbag::BagUnindexedException&)
  {
    throw BagError(path +
                   ": was not finished: its recorder still runs, or was killed; in the latter case: rosbag reindex " +
                   path);
  }
  catch (const rosbag::BagException& e)
  {
    throw BagError(path + ": is no ROS bag, or is cut off or damaged (" + e.what() +
                   "); copy it anew, or try: rosbag reindex " + path);
  }
  catch (const std::runtime_error& e)   // a directory, a device
  {
    throw BagError(e.what());
  }
}

namespace {

bool endsWith(const std::string& text, const std::string& end)
{
  return text.size() >= end.size() && text.compare(text.size() - end.size(), end.size(), end) == 0;
}

std::string withoutEnd(const std::string& text, const std::string& end)
{
  return text.substr(0, text.size() - end.size());
}

/// Namespace of the node, given that of a topic: in scenes of several kinds each kind has its own namespace, and the
/// topic `scene` is outside of these.
std::string nodeOf(const std::string& topic_namespace, const std::set<std::string>& topics)
{
  for (const char* kind : {"/rods", "/threads", "/cloths"})
    if (endsWith(topic_namespace, kind) && topics.count(withoutEnd(topic_namespace, kind) + "/scene"))
      return withoutEnd(topic_namespace, kind);
  return topic_namespace;
}

}   // namespace

void BagReader::Contents::choosePrefix(const std::string& topic_namespace)
{
  static const std::set<std::string> ours{"slender_sim/RodState", "slender_sim/ThreadState", "slender_sim/ClothState",
                                          "slender_sim/BodyStates"};
  std::set<std::string> found, topics;
  rosbag::View all(bag);
  for (const rosbag::ConnectionInfo* connection : all.getConnections())
    topics.insert(connection->topic);
  for (const rosbag::ConnectionInfo* connection : all.getConnections())
    for (const char* name : {"/state", "/body_states"})
      if (ours.count(connection->datatype) && endsWith(connection->topic, name))
        found.insert(nodeOf(withoutEnd(connection->topic, name), topics));
  if (found.empty())
    throw BagError(path +
                   ": holds no states of slender_sim; record with simulate --bag, with ~record_bag of a node, or at "
                   "least its topic `state`");
  std::string wanted = topic_namespace;
  while (!wanted.empty() && wanted.back() == '/')
    wanted.pop_back();
  std::vector<std::string> names(found.begin(), found.end());
  if (names.front().empty())
    names.front() = "/";
  if (topic_namespace.empty() ? found.size() > 1 : found.count(wanted) == 0)
    throw BagError(path + ": holds the states of " + joinWords(names) + "; choose one with --namespace");
  prefix = (topic_namespace.empty() ? *found.begin() : wanted) + "/";
}

void BagReader::Contents::readScene(const std::string& folder)
{
  rosbag::View scenes(bag, rosbag::TopicQuery(prefix + "scene"));
  for (const rosbag::MessageInstance& instance : scenes)
    if (const auto text = instance.instantiate<std_msgs::String>())
      try
      {
        scene = parseScene(text->data, "the recorded scene", {}, folder);
        break;
      }
      catch (const SceneError& e)
      {
        scene_problem = e.what();
      }
  if (!scene && scene_problem.empty())
    scene_problem = "the topic " + prefix + "scene is not in the bag";
  rosbag::View recorded(bag, rosbag::TopicQuery(std::vector<std::string>{prefix + "mesh", prefix + "cloths/mesh"}));
  for (const rosbag::MessageInstance& instance : recorded)
    if (const auto message = instance.instantiate<slender_sim::MeshStamped>())
    {
      const slender_sim::MeshStamped& mesh = *message;
      for (std::size_t k = 0; k < mesh.names.size(); ++k)
        requireArrays(mesh.vertex_offsets.size() == mesh.names.size() &&
                          mesh.triangle_offsets.size() == mesh.names.size() &&
                          mesh.vertex_offsets[k] <= mesh.vertices.size() &&
                          3 * std::size_t{mesh.triangle_offsets[k]} <= mesh.triangles.size(),
                      "mesh");
      meshes.push_back(mesh);
    }
}

void BagReader::Contents::openStreams()
{
  std::set<std::pair<std::string, std::string>> seen;
  rosbag::View all(bag,
                   [this](const rosbag::ConnectionInfo* c) { return c->topic.compare(0, prefix.size(), prefix) == 0; });
  for (const rosbag::ConnectionInfo* connection : all.getConnections())
    if (seen.insert({connection->topic, connection->datatype}).second)
      openStream(*connection, connection->topic.substr(prefix.size()));
}

/// `name` is that of the topic, without the prefix.
void BagReader::Contents::openStream(const rosbag::ConnectionInfo& connection, const std::string& name)
{
  const SceneConfig* const known = scene ? &*scene : nullptr;
  // in scenes of several kinds each kind has its own namespace
  const auto isState = [&](const std::string& kind) { return name == "state" || name == kind + "/state"; };
  stream<slender_sim::RodState>(connection, isState("rods"), [this, known](const auto& m) {
    takeStep(m);
    addSnapshot(m, known, *out);
  });
  stream<slender_sim::ThreadState>(connection, isState("threads"), [this](const auto& m) {
    takeStep(m);
    addSnapshot(m, *out);
  });
  stream<slender_sim::ClothState>(connection, isState("cloths"), [this, known](const auto& m) {
    takeStep(m);
    addSnapshot(m, meshes, known, *out);
  });
  stream<slender_sim::BodyStates>(connection, name == "body_states",
                                  [this](const auto& m) { addSnapshot(m, out->bodies); });
  stream<slender_sim::BodyStates>(connection, name == "obstacle_states",
                                  [this](const auto& m) { addSnapshot(m, out->obstacles); });
  stream<slender_sim::Fields>(connection, name == "fields", [this](const auto& m) { addSnapshot(m, *out); });
  stream<slender_sim::GraspStates>(connection, name == "grasp_states", [this](const auto& m) {
    requireArrays(
        m.object.size() == m.name.size() && m.active.size() == m.name.size() && m.pose.size() == m.name.size(),
        "grasp_states");
    for (std::size_t g = 0; g < m.name.size(); ++g)
      grasp(m.name[g]).held = GraspSnapshot::Held{m.object[g], m.active[g] != 0, recordedPose(m.pose[g])};
  });
  const bool of_grasp = name.size() > 14 && name.compare(0, 7, "grasps/") == 0 && endsWith(name, "/wrench");
  const std::string of = of_grasp ? name.substr(7, name.size() - 14) : std::string();
  stream<geometry_msgs::WrenchStamped>(connection, of_grasp, [this, of](const auto& m) {
    grasp(of).wrench = {fromMessage(m.wrench.force), fromMessage(m.wrench.torque)};
    if (endsWith(m.header.frame_id, "/grasps/" + of))
      own_axes.push_back(of);
  });
}

void BagReader::Contents::findStepLength()
{
  if (scene)
  {
    step_length = scene->time.step;
    return;
  }
  // what is published says how many steps were taken until when
  std::optional<std::pair<std::int64_t, std::uint64_t>> first;
  const auto look = [&](const auto& message) {
    const std::int64_t ns = static_cast<std::int64_t>(message.header.stamp.toNSec());
    if (!first)
      first = {ns, message.step};
    else if (message.step > first->second)
      step_length =
          shortestStep(static_cast<double>(ns - first->first), static_cast<double>(message.step - first->second));
  };
  rosbag::View states(bag,
                      rosbag::TopicQuery(std::vector<std::string>{prefix + "state", prefix + "rods/state",
                                                                  prefix + "threads/state", prefix + "cloths/state"}));
  for (const rosbag::MessageInstance& instance : states)
    if (const auto rod = instance.instantiate<slender_sim::RodState>())
      look(*rod);
    else if (const auto thread = instance.instantiate<slender_sim::ThreadState>())
      look(*thread);
    else if (const auto cloth = instance.instantiate<slender_sim::ClothState>())
      look(*cloth);
}

GraspSnapshot& BagReader::Contents::grasp(const std::string& name)
{
  for (GraspSnapshot& grasp : out->grasps)
    if (grasp.name == name)
      return grasp;
  out->grasps.emplace_back();
  out->grasps.back().name = name;
  return out->grasps.back();
}

void BagReader::Contents::turnWrenches()
{
  for (const std::string& name : own_axes)
  {
    GraspSnapshot& turned = grasp(name);
    if (!turned.held)
      throw BagError("the wrench of grasp " + name +
                     " is in the axes of the grasp: record the topic grasp_states, too");
    const Eigen::Quaterniond& q = turned.held->X_WG.orientation;
    turned.wrench = {q * turned.wrench.force, q * turned.wrench.torque};
  }
  own_axes.clear();
}

BagReader::BagReader(const std::string& path, const std::string& topic_namespace, const std::string& scene_folder)
  : contents_(std::make_unique<Contents>())
{
  contents_->path = path;
  contents_->open();
  try
  {
    contents_->choosePrefix(topic_namespace);
    contents_->readScene(scene_folder);
    contents_->findStepLength();
    contents_->openStreams();
  }
  catch (const ros::Exception& e)   // rosbag's, and messages cut short
  {
    throw BagError(path + ": is damaged (" + e.what() + "); copy it anew, or try: rosbag fix");
  }
}

BagReader::BagReader(BagReader&&) noexcept = default;
BagReader::~BagReader() = default;

bool BagReader::next(SceneSnapshot& out)
{
  Contents& c = *contents_;
  std::optional<ros::Time> stamp;
  for (const auto& stream : c.streams)
    if (stream->alive() && (!stamp || stream->stamp() < *stamp))
      stamp = stream->stamp();
  if (!stamp)
    return false;
  out = SceneSnapshot();
  c.out = &out;
  c.step_known = false;
  const std::int64_t before = c.stamp;
  const std::uint64_t step_before = c.step;
  c.stamp = static_cast<std::int64_t>(stamp->toNSec());
  try
  {
    for (const auto& stream : c.streams)
      for (; stream->alive() && stream->stamp() == *stamp; ++c.done)
        stream->take();
    c.turnWrenches();
  }
  catch (const ros::Exception& e)   // rosbag's, and messages cut short
  {
    throw BagError(c.path + ": is damaged (" + e.what() + "); copy it anew, or try: rosbag fix");
  }
  catch (const std::bad_alloc&)   // a length that is none
  {
    throw BagError(c.path + ": is damaged (a message of impossible length); copy it anew, or try: rosbag fix");
  }
  catch (const BagError& e)
  {
    throw BagError(c.path + ": " + e.what());
  }
  if (!c.step_known && c.first_stamp && c.step_length > 0)   // bodies only, or their states were dropped
    c.step = step_before +
             static_cast<std::uint64_t>(std::llround(1e-9 * static_cast<double>(c.stamp - before) / c.step_length));
  if (!c.first_stamp)
    c.first_stamp = c.stamp;
  if (c.step_known)
    c.gaps.add(c.epoch, c.step, 1e-9 * static_cast<double>(c.stamp - *c.first_stamp));
  out.time = static_cast<double>(c.step) * c.step_length;
  return true;
}

double BagReader::seconds() const
{
  return 1e-9 * static_cast<double>(contents_->stamp - contents_->first_stamp.value_or(contents_->stamp));
}
std::string BagReader::gaps() const { return contents_->gaps.text(contents_->step_length); }
const SceneConfig* BagReader::scene() const { return contents_->scene ? &*contents_->scene : nullptr; }
const std::string& BagReader::sceneProblem() const { return contents_->scene_problem; }
std::size_t BagReader::messages() const { return contents_->messages; }
std::size_t BagReader::done() const { return contents_->done; }

}   // namespace slender
