#pragma once

#include <memory>
#include <stdexcept>
#include <string>

#include "slender_sim/scene/snapshot.h"

namespace slender {

/// A bag that cannot be used; what() names the file and what to do.
struct BagError : std::runtime_error
{
  using std::runtime_error::runtime_error;
};

/// Goes through what a node or `simulate` recorded, or `rosbag record` of their topics, one instant after the other.
/// Needs no master.
class BagReader
{
public:
  /// `topic_namespace`: before the topics, e.g. "/rod_node"; empty: the only one in the bag. `scene_folder`: where the
  /// files lie that the recorded scene names. Throws BagError: missing, unfinished, cut off, damaged, without our
  /// topics, of several nodes.
  BagReader(const std::string& path, const std::string& topic_namespace = "", const std::string& scene_folder = ".");
  BagReader(BagReader&&) noexcept;
  ~BagReader();

  /// The next instant; false after the last one. Throws BagError.
  bool next(SceneSnapshot& out);
  /// Of the instant that next() gave, since the first one in the bag [s]; unlike the scene's own time it grows through
  /// resets.
  double seconds() const;

  /// The recorded scene; null when there is none or its files are not in `scene_folder` (sceneProblem() says which).
  const SceneConfig* scene() const;
  const std::string& sceneProblem() const;

  /// What is missing between the instants that next() gave so far, in one or two sentences; empty when nothing is.
  std::string gaps() const;

  /// For progress: messages in the bag, and how many were gone through.
  std::size_t messages() const;
  std::size_t done() const;

private:
  struct Contents;
  std::unique_ptr<Contents> contents_;
};

}   // namespace slender
