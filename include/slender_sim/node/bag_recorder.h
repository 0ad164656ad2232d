#pragma once

#include <memory>
#include <string>
#include <vector>

#include "slender_sim/Input.h"
#include "slender_sim/node/scene_messages.h"
#include "slender_sim/node/scene_topics.h"
#include "slender_sim/scene/recorder.h"

namespace rosbag {
class Bag;
}

namespace slender {

/// Writes a bag in-process: topics drop messages, this does not. Messages go in a fixed order with their own stamps and
/// nothing of the machine or the hour, so that two equal runs leave files of equal bytes.
class BagRecorder
{
public:
  /// Opens PATH.active, which close() renames to PATH. If PATH is a symbolic link, both names are those of its target.
  /// An existing bag is kept as previousBag(PATH), and notes() report this. `topic_namespace` is put before the names
  /// of the topics (see SceneTopics), for example "/". Throws std::runtime_error if the file cannot be written, if PATH
  /// is not a regular file, or if a guide of the scene reads this bag.
  BagRecorder(const std::string& path, const std::string& topic_namespace, const Simulation& simulation);
  ~BagRecorder();

  /// Records the text of the scene on the topic `scene`. Call it before the first record().
  void recordScene(const std::string& yaml, const ros::Time& stamp);
  /// Records the undeformed cloths on the topic `mesh`. Call it before the first record() if the scene has cloths.
  void recordMesh(const slender_sim::MeshStamped& mesh);
  /// Records the edited scene from now on. Call recordScene(), and recordMesh() if it has cloths, before record().
  void sceneChanged(const Simulation& simulation) { topics_ = SceneTopics(simulation); }
  /// Records an input that changes the run, on the topic `inputs`.
  void recordInput(const slender_sim::Input& input);
  /// `state` per rod (of all cloths one), then `grasps/NAME/wrench` per grasp, then `body_states` if there are bodies,
  /// `nozzle/wrench` per thread, `grasp_states` and `obstacle_states` if there are any, and `fields` if the scene asks
  /// for them; the rest can be derived from these. These four throw WriteError.
  void record(const SceneMessages& messages);
  /// Throws WriteError when the file cannot be completed.
  void close();

  const std::string& path() const { return path_; }
  /// Tells the user where bags that existed before are kept, one sentence per bag.
  const std::vector<std::string>& notes() const { return notes_; }

private:
  void keepEarlierBags(const std::string& active);
  template <class Message>
  void write(const std::string& topic, const ros::Time& stamp, const Message& message);
  std::string remains() const;

  const std::string prefix_;
  SceneTopics topics_;
  std::string path_;
  std::vector<std::string> notes_;
  std::unique_ptr<rosbag::Bag> bag_;
  bool open_ = false;
};

/// Returns a recorder for `simulate --bag`. It writes the same bag as rod_node does with `~start_time: 1`, the frame
/// world and no namespace.
std::unique_ptr<Recorder> makeBagRecorder(const std::string& path);

}   // namespace slender
