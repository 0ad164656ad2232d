// The reference of scene files in docs is what the reader asks for today; the scenes in the documents are ones.
#include <algorithm>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <sstream>

#include <gtest/gtest.h>

#include "slender_sim/scene/reader.h"
#include "slender_sim/scene/scene_reference.h"
#include "study/framework/whole_file.h"
#include "test/support/shell.h"

namespace slender::test {
namespace {

const std::string kSource = SLENDER_SOURCE_DIR;

const SceneKey& keyOf(const std::vector<SceneKey>& keys, const std::string& path)
{
  static const SceneKey none{"not there", "not there", "", ""};
  const auto key = std::find_if(keys.begin(), keys.end(), [&](const SceneKey& k) { return k.path == path; });
  return key == keys.end() ? none : *key;
}

TEST(SceneReference, IsUpToDate)
{
  EXPECT_EQ(wholeFile(kSource + "/docs/scene_reference.md"), sceneReference(sceneKeys()))
      << "run scene_reference > docs/scene_reference.md";
}

TEST(SceneReference, NamesRangesAndUnits)
{
  const std::vector<SceneKey> all = sceneKeys();
  EXPECT_EQ(keyOf(all, "time.step").what, "a number in (0, 10] s");
  EXPECT_EQ(keyOf(all, "rods.N.grasps.NAME.hold").what, "one of: frame, position");
  EXPECT_EQ(keyOf(all, "cloths.N.plasticity.yield_curvature").what, "a number in [0, 1000000000] 1/m");
  EXPECT_EQ(keyOf(all, "bodies.N.welds.N.edge").what, "an index from 0 or, if it is negative, from the end");
  EXPECT_EQ(keyOf(all, "record.fields").what.substr(0, 38), "a list, each entry one of: curvature, ");
}

TEST(SceneReference, SaysWhatEachKeyMeans)
{
  const std::vector<SceneKey> all = sceneKeys();
  EXPECT_GT(all.size(), 400u);
  for (const SceneKey& key : all)
  {
    const std::string& text = key.meaning;
    ASSERT_FALSE(text.empty()) << key.path;
    // a sentence begins with a capital or a quoted word, and ends with a full stop
    EXPECT_TRUE(std::isupper(static_cast<unsigned char>(text[0])) || text[0] == '`' ||
                std::isdigit(static_cast<unsigned char>(text[0])))
        << key.path << ": " << text;
    EXPECT_EQ(text.back(), '.') << key.path << ": " << text;
    EXPECT_EQ(text.find("  "), std::string::npos) << key.path << ": " << text;
    EXPECT_EQ(text.find(";  "), std::string::npos) << key.path << ": " << text;
  }
}

TEST(SceneReference, SaysWhatEachKeyTakes)
{
  const std::vector<SceneKey> all = sceneKeys();
  for (const SceneKey& key : all)
  {
    const auto isBelow = [&](const SceneKey& other) { return other.path.rfind(key.path + ".", 0) == 0; };
    EXPECT_TRUE(!key.what.empty() || !key.keys_of.empty() || std::any_of(all.begin(), all.end(), isBelow)) << key.path;
    if (!key.keys_of.empty())
      EXPECT_EQ(keyOf(all, key.keys_of).path, key.keys_of) << key.path;
  }
}

/// The scene inside the library leads the reader to every key that the shipped scenes lead to.
TEST(SceneReference, KnowsTheKeysOfTheShippedScenes)
{
  std::vector<std::string> files;
  for (const auto& entry : std::filesystem::directory_iterator(kSource + "/config/scenes"))
    if (entry.path().extension() == ".yaml")
      files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  const std::vector<SceneKey> all = sceneKeys();
  const std::vector<SceneKey> shipped = sceneKeys(files);
  EXPECT_GT(shipped.size(), 300u);
  for (const SceneKey& key : shipped)
  {
    const SceneKey& known = keyOf(all, key.path);
    EXPECT_EQ(known.path, key.path);
    EXPECT_EQ(known.meaning, key.meaning) << key.path;
    // a value that the reader took in a shipped scene, and not in the scene inside the library, is missing in the page
    EXPECT_TRUE(!known.what.empty() || key.what.empty()) << key.path << ": " << key.what;
  }
}

TEST(SceneReference, ExplainsOneKey)
{
  const std::vector<SceneKey> all = sceneKeys();
  const std::string attach = describeKeys(all, "rods.N.grasps.NAME.attach");
  EXPECT_EQ(attach.substr(0, 54), "rods.N.grasps.NAME.attach\n    one of: section, initial");
  EXPECT_NE(attach.find("Without the key: section."), std::string::npos) << attach;
  EXPECT_EQ(describeKeys(all, "rods.0.grasps.left.attach"), attach);
  // a path into a section that is described elsewhere
  EXPECT_EQ(describeKeys(all, "generate.2.hair.material.density"), describeKeys(all, "rods.N.material.density"));
  EXPECT_EQ(describeKeys(all, "rods.N.grasps.NAME.attch"), "");
  EXPECT_EQ(nearestKey(all, "rods.N.grasps.NAME.attch"), "attach");
}

TEST(SceneReference, ExplainsAllKeysOfAName)
{
  const std::string text = describeKeys(sceneKeys(), "attach");
  for (const char* path :
       {"rods.N.grasps.NAME.attach\n", "cloths.N.grasps.NAME.attach\n", "tracked.N.guide.motion.attach\n"})
    EXPECT_NE(text.find(path), std::string::npos) << text;
  EXPECT_EQ(text.find("hold"), std::string::npos) << text;
}

TEST(SceneReference, ExplainsASection)
{
  const std::string text = describeKeys(sceneKeys(), "rods.N.material");
  for (const char* line : {"rods.N.material\n", "rods.N.material.density\n", "rods.N.material.twist_modulus\n",
                           "Same keys: generate.N.chain.material, "})
    EXPECT_NE(text.find(line), std::string::npos) << text;
  for (std::istringstream lines(text); lines;)
  {
    std::string line;
    std::getline(lines, line);
    EXPECT_LE(line.size(), 100u) << line;
  }
}

TEST(SceneReference, IsAProgram)
{
  const Result result = shell(std::string(SLENDER_SCENE_REFERENCE) + " --key rods.0.grasps.left.hold");
  EXPECT_EQ(result.status, 0) << result.output;
  EXPECT_NE(result.output.find("one of: frame, position"), std::string::npos) << result.output;
  const Result wrong = shell(std::string(SLENDER_SCENE_REFERENCE) + " --key frction");
  EXPECT_EQ(wrong.status, 2);
  EXPECT_NE(wrong.output.find("no key frction (did you mean friction?)"), std::string::npos) << wrong.output;
  EXPECT_EQ(shell(std::string(SLENDER_SCENE_REFERENCE)).output, sceneReference(sceneKeys()));
}

TEST(SceneReference, SaysWhichFileIsNotThere) { EXPECT_THROW(sceneKeys({kSource + "/none.yaml"}), SceneError); }

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

}   // namespace
}   // namespace slender::test
