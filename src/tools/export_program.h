#pragma once

#include <functional>
#include <map>
#include <string>

#include "slender_sim/node/bag_reader.h"

/// What the programs that export bags share.
namespace slender {

struct ExportOptions
{
  std::string bag, out, topic_namespace, scene_folder = ".";
  bool quiet = false;
};

/// Takes the value of an option of one program; throws BadInput.
using OptionTaker = std::function<void(const std::string& option, const std::string& value)>;

/// Parses `BAG --out PATH [--namespace NS] [--scene-dir DIR] [--quiet]` and a program's own options, and runs it. Its
/// exit status: 0 done, 2 bad input (BadInput, BagError), 3 another failure.
int exportProgram(const std::string& name, const std::string& usage, int argc, char** argv,
                  const std::map<std::string, OptionTaker>& own, const std::function<void(const ExportOptions&)>& run);

/// Opens the bag, and says on stderr when its scene cannot be read, and that `loses` then.
BagReader openBag(const std::string& program, const ExportOptions& options, const std::string& loses);

/// Goes through the bag with progress on stderr, and warns there when steps are missing.
void eachInstant(const std::string& program, const ExportOptions& options, BagReader& bag,
                 const std::function<void(const SceneSnapshot&)>& use);

/// Which instants become frames: all (fps 0), or the first at or after each 1/fps seconds.
class FrameChoice
{
public:
  explicit FrameChoice(double fps) : fps_(fps) {}
  bool takes(double seconds);

private:
  double fps_;
  long next_ = 0;
};

/// A folder or file that has its name only once it is complete: until keep() it is PATH.part, and is removed without
/// it.
class Staged
{
public:
  enum class Kind
  {
    folder,
    file
  };
  /// Throws BadInput when `path` is a folder that is not empty, or cannot be made.
  Staged(Kind kind, std::string path);
  Staged(const Staged&) = delete;
  ~Staged();

  const std::string& part() const { return part_; }
  /// Throws std::runtime_error.
  void keep();

private:
  std::string path_, part_;
  bool kept_ = false;
};

}   // namespace slender
