#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

/// The rooms depend on each other one way only (docs/architecture.md): node -> scene -> world -> {rod, thread, cloth,
/// tracking, fairing} -> island -> contact -> dynamics -> energy -> geometry -> linalg; study is beside node.
namespace {

namespace fs = std::filesystem;

const std::map<std::string, int> level{{"linalg", 0},  {"geometry", 1}, {"energy", 2}, {"dynamics", 3}, {"contact", 4},
                                       {"island", 5},  {"rod", 6},      {"thread", 6}, {"cloth", 6},    {"tracking", 6},
                                       {"fairing", 6}, {"world", 7},    {"scene", 8},  {"node", 9},     {"study", 9},
                                       {"nodes", 10},  {"tools", 10}};

struct Include
{
  std::string file, room, header;
  int line;
};

/// What an #include line includes; empty for any other line.
std::string includedHeader(const std::string& line)
{
  const auto hash = line.find_first_not_of(" \t");
  if (hash == std::string::npos || line[hash] != '#')
    return "";
  const auto word = line.find_first_not_of(" \t", hash + 1);
  if (word == std::string::npos || line.compare(word, 7, "include") != 0)
    return "";
  const auto open = line.find_first_of("<\"", word + 7);
  const auto close = open == std::string::npos ? open : line.find_first_of(">\"", open + 1);
  return close == std::string::npos ? "" : line.substr(open + 1, close - open - 1);
}

bool isRos(const std::string& header)
{
  static const std::set<std::string> packages{"ros",
                                              "rosbag",
                                              "tf",
                                              "tf2",
                                              "tf2_ros",
                                              "std_srvs",
                                              "nodelet",
                                              "pluginlib",
                                              "diagnostic_updater",
                                              "interactive_markers",
                                              "rosconsole",
                                              "xmlrpcpp"};
  const auto slash = header.find('/');
  const std::string package = header.substr(0, slash);
  const bool messages = package.size() > 5 && package.compare(package.size() - 5, 5, "_msgs") == 0;
  return slash != std::string::npos && (messages || packages.count(package));
}

std::vector<Include> allIncludes()
{
  std::vector<Include> includes;
  for (const char* top : {"include/slender_sim", "src"})
  {
    const fs::path root = fs::path(SLENDER_SOURCE_DIR) / top;
    for (const auto& entry : fs::recursive_directory_iterator(root))
    {
      const std::string suffix = entry.path().extension().string();
      if (!entry.is_regular_file() || (suffix != ".h" && suffix != ".cpp" && suffix != ".hpp" && suffix != ".inc"))
        continue;
      const fs::path relative = fs::relative(entry.path(), root);
      std::ifstream file(entry.path());
      std::string text;
      for (int line = 1; std::getline(file, text); ++line)
      {
        const std::string header = includedHeader(text);
        if (!header.empty())
          includes.push_back({(fs::path(top) / relative).string(), relative.begin()->string(), header, line});
      }
    }
  }
  return includes;
}

/// Of a public header, or of one that is written from src; empty for other headers.
std::string roomOf(const std::string& header)
{
  const std::string prefix = "slender_sim/";
  const std::string path = header.compare(0, prefix.size(), prefix) == 0 ? header.substr(prefix.size()) : header;
  const std::string room = path.substr(0, path.find('/'));
  return room != path && level.count(room) ? room : "";
}

TEST(Layers, everyFolderIsARoom)
{
  for (const Include& include : allIncludes())
    EXPECT_TRUE(level.count(include.room)) << include.file << ": " << include.room << " is no room of DESIGN 1";
}

TEST(Layers, dependenciesPointDown)
{
  int checked = 0;
  for (const Include& include : allIncludes())
  {
    EXPECT_NE(include.header.substr(0, 3), "../") << include.file << ":" << include.line << ": write it from src";
    const auto from = level.find(include.room), to = level.find(roomOf(include.header));
    if (from == level.end() || to == level.end() || from->first == to->first)
      continue;
    ++checked;
    EXPECT_LT(to->second, from->second) << include.file << ":" << include.line << ": " << from->first
                                        << " must not include " << include.header;
  }
  EXPECT_GT(checked, 10);   // the walk found the sources
}

TEST(Layers, onlyNodesKnowRos)
{
  for (const Include& include : allIncludes())
  {
    if (include.room == "node" || include.room == "nodes")
      continue;
    EXPECT_FALSE(isRos(include.header)) << include.file << ":" << include.line << ": " << include.header;
  }
}

TEST(Layers, onlyContactAndItsChecksKnowFclAndOnlySceneKnowsYaml)
{
  for (const Include& include : allIncludes())
  {
    EXPECT_FALSE(include.room != "contact" && include.room != "study" && include.header.compare(0, 4, "fcl/") == 0)
        << include.file;
    const bool yaml = include.header.compare(0, 9, "yaml-cpp/") == 0;
    const bool configures_rviz = include.file == "src/node/camera_fit.cpp";   // the configuration of rviz is YAML
    EXPECT_FALSE(yaml && include.file.compare(0, 10, "src/scene/") != 0 && !configures_rviz)
        << include.file << " must not include " << include.header;
  }
}

TEST(Layers, noFileIsTooLong)
{
  std::set<std::string> folders{"include", "src", "test", "bench"};
  for (const std::string& folder : folders)
  {
    const fs::path root = fs::path(SLENDER_SOURCE_DIR) / folder;
    if (!fs::exists(root))
      continue;
    for (const auto& entry : fs::recursive_directory_iterator(root))
    {
      if (!entry.is_regular_file())
        continue;
      std::ifstream file(entry.path());
      std::string line;
      int count = 0;
      while (std::getline(file, line))
        ++count;
      EXPECT_LE(count, 550) << entry.path();
    }
  }
}

}   // namespace
