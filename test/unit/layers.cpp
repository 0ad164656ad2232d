#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

/// The rooms depend on each other one way only (DESIGN 1): node -> scene -> world -> {rod, thread, cloth, tracking,
/// fairing} -> {energy, dynamics, contact} -> {geometry, linalg}; study sits beside node.
namespace {

namespace fs = std::filesystem;

const std::map<std::string, int> level{{"linalg", 0},   {"geometry", 0}, {"energy", 1}, {"dynamics", 1},
                                       {"contact", 1},  {"rod", 2},      {"thread", 2}, {"cloth", 2},
                                       {"tracking", 2}, {"fairing", 2},  {"world", 3},  {"scene", 4},
                                       {"node", 5},     {"study", 5},    {"nodes", 6},  {"tools", 6}};

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

std::string roomOf(const std::string& header)
{
  const std::string prefix = "slender_sim/";
  if (header.compare(0, prefix.size(), prefix) != 0)
    return "";
  const auto slash = header.find('/', prefix.size());
  return slash == std::string::npos ? "" : header.substr(prefix.size(), slash - prefix.size());
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
    const auto from = level.find(include.room), to = level.find(roomOf(include.header));
    if (from == level.end() || to == level.end() || from->first == to->first)
      continue;
    ++checked;
    // Rooms of one level may use each other (energy and dynamics; geometry and linalg) except the solvers and
    // node/study.
    const bool siblings_allowed = from->second <= 1;
    EXPECT_TRUE(to->second < from->second || (siblings_allowed && to->second == from->second))
        << include.file << ":" << include.line << ": " << from->first << " must not include " << include.header;
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

TEST(Layers, onlyContactKnowsFclAndOnlySceneKnowsYaml)
{
  for (const Include& include : allIncludes())
  {
    EXPECT_FALSE(include.room != "contact" && include.header.compare(0, 4, "fcl/") == 0) << include.file;
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
