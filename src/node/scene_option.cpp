#include "slender_sim/node/scene_option.h"

#include <filesystem>

#include "slender_sim/node/guide_bag.h"
#include "slender_sim/scene/reader.h"

namespace slender {
namespace {

/// Returns true if `scene` is the text of a scene, and false if it is the path of a file.
bool isText(const std::string& scene)
{
  std::error_code error;
  return scene.find('\n') != std::string::npos ||
         (scene.find(": ") != std::string::npos && !std::filesystem::exists(scene, error));
}

}   // namespace

SceneConfig readScene(const NodeOptions& options)
{
  setGuideBagReader(readGuideBag);
  return isText(options.scene) ? parseScene(options.scene, "~scene", options.overrides)
                               : readScene(options.scene, options.overrides);
}

}   // namespace slender
