// The reference of scene files in docs is what the reader asks for today, and the scenes in the text are ones.
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>

#include <gtest/gtest.h>

#include "slender_sim/scene/reader.h"
#include "slender_sim/scene/scene_reference.h"

namespace slender::test {
namespace {

const std::string kSource = SLENDER_SOURCE_DIR;

std::vector<SceneKey> keys()
{
  std::vector<std::string> files;
  for (const auto& entry : std::filesystem::directory_iterator(kSource + "/config/scenes"))
    if (entry.path().extension() == ".yaml")
      files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  files.push_back(kSource + "/test/scenes/every_key.yaml");
  return sceneKeys(files);
}

TEST(SceneReference, IsUpToDate)
{
  std::ifstream file(kSource + "/docs/scene_reference.md");
  std::ostringstream text;
  text << file.rdbuf();
  EXPECT_EQ(text.str(), sceneReference(keys()))
      << "run scene_reference config/scenes/*.yaml test/scenes/every_key.yaml > docs/scene_reference.md";
}

TEST(SceneReference, NamesRangesAndUnits)
{
  const std::vector<SceneKey> all = keys();
  const auto what = [&](const std::string& path) {
    const auto key = std::find_if(all.begin(), all.end(), [&](const SceneKey& k) { return k.path == path; });
    return key == all.end() ? std::string("not there") : key->what;
  };
  EXPECT_EQ(what("time.step"), "a number in (0, 10] s");
  EXPECT_EQ(what("rods.N.grasps.NAME.hold"), "one of: frame, position");
  EXPECT_EQ(what("cloths.N.plasticity.yield_curvature"), "a number in [0, 1000000000] 1/m");
  EXPECT_EQ(what("rods.N.grasps.NAME.edges.N"), "a place, counted from 0, or from the end by negative numbers");
}

/// The scenes of a page: code that is YAML and begins with a name. Parts of scenes and plans of sweeps do not count.
std::vector<std::string> scenesOf(const std::string& page)
{
  std::vector<std::string> scenes;
  std::ifstream file(page);
  std::string code;
  bool inside = false;
  for (std::string line; std::getline(file, line);)
    if (inside && line == "```")
    {
      if (code.rfind("name:", 0) == 0 && code.find("\naxes:") == std::string::npos)
        scenes.push_back(code);
      inside = false;
    }
    else if (line == "```yaml")
    {
      inside = true;
      code.clear();
    }
    else if (inside)
      code += line + "\n";
  return scenes;
}

TEST(Documents, ShowScenesThatAreRead)
{
  std::vector<std::string> pages{kSource + "/README.md"};
  for (const auto& entry : std::filesystem::directory_iterator(kSource + "/docs"))
    if (entry.path().extension() == ".md")
      pages.push_back(entry.path());
  std::size_t count = 0;
  for (const std::string& page : pages)
  {
    const std::vector<std::string> scenes = scenesOf(page);
    count += scenes.size();
    for (const std::string& scene : scenes)
    {
      EXPECT_NO_THROW(parseScene(scene, page)) << scene;
    }
  }
  EXPECT_GE(count, 7u);   // one of README, four of the tutorials, and at least one of each of two pages
}

TEST(SceneReference, SaysWhichFileIsNotThere) { EXPECT_THROW(sceneKeys({kSource + "/none.yaml"}), SceneError); }

}   // namespace
}   // namespace slender::test
