// `record: {nodes: ...}`: the reader's choice of nodes, and the rows of tables that follow from it.
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "slender_sim/scene/csv_tables.h"
#include "slender_sim/scene/reader.h"
#include "slender_sim/scene/simulation.h"

namespace slender {
namespace {

const std::string kPlainRope = "rods:\n  - {name: rope, centerline: {straight: {edges: 10}}}\n";
const std::string kMixed = R"(
rods:
  - {name: rope, centerline: {straight: {edges: 10}}}
  - {name: ring, closed: true, centerline: {arc: {angle: 6.283185307179586, edges: 8}}}
cloths:
  - {name: flag, grid: {sides: [[1, 0, 0], [0, 1, 0]], cells: [2, 2], pattern: one_diagonal}}
)";
const std::string kHoney = "threads:\n  - {name: honey, fluid: {}, centerline: {straight: {edges: 4}}, radius: 0.01}\n";

NodeChoice chosen(const std::string& scene, const std::string& nodes)
{
  return parseScene(scene, "test.yaml", {"record.nodes=" + nodes}).record.nodes;
}

TEST(RecordNodes, AreReadAsGraspsHaveThem)
{
  EXPECT_TRUE(parseScene(kPlainRope).record.nodes.empty());
  EXPECT_EQ(chosen(kPlainRope, "[-1, 0, 4..6]"), (NodeChoice{{"rope", {0, 4, 5, 6, 10}}}));
  EXPECT_EQ(chosen(kPlainRope, "{rope: [3]}"), (NodeChoice{{"rope", {3}}}));
  EXPECT_EQ(chosen(kPlainRope, "{rope: []}"), (NodeChoice{{"rope", {}}}));
  EXPECT_EQ(chosen(kPlainRope, "[]"), (NodeChoice{{"rope", {}}}));
  // a closed rod has as many nodes as edges; the grid has 3 x 3 vertices
  EXPECT_EQ(chosen(kMixed, "{ring: [-1], flag: [-2..-1]}"), (NodeChoice{{"ring", {7}}, {"flag", {7, 8}}}));
  // rods that a generator makes
  EXPECT_EQ(chosen("generate:\n  - hair: {strands: 2, edges: 5}\n", "{hair_1: [-1]}"), (NodeChoice{{"hair_1", {5}}}));
}

struct NodesCase
{
  std::string scene, nodes, part;
};

class BadRecordNodes : public testing::TestWithParam<NodesCase>
{};

TEST_P(BadRecordNodes, AreReported)
{
  try
  {
    chosen(GetParam().scene, GetParam().nodes);
    FAIL() << GetParam().nodes;
  }
  catch (const SceneError& error)
  {
    const std::string text = error.what();
    EXPECT_NE(text.find(GetParam().part), std::string::npos) << text;
    EXPECT_NE(text.find("record.nodes"), std::string::npos) << text;
  }
}

INSTANTIATE_TEST_SUITE_P(
    Cases, BadRecordNodes,
    testing::Values(NodesCase{kPlainRope, "[11]", "must be a whole number in [-11, 10]"},
                    NodesCase{kPlainRope, "{rope: [3..11]}", "must be FIRST..LAST with whole numbers in [-11, 10]"},
                    NodesCase{kPlainRope, "[1.5]", "must be a whole number"},
                    NodesCase{kPlainRope, "[2, 1..3]", "names node 2 twice"},
                    NodesCase{kPlainRope, "3", "must be a list"},
                    NodesCase{kPlainRope, "{rop: [0]}", "is no rod or cloth of the scene (did you mean rope?)"},
                    NodesCase{kMixed, "[0]", "this one has 3 rods, cloths and threads; must be a map"},
                    NodesCase{kMixed, "{flag: [9]}", "must be a whole number in [-9, 8]"},
                    NodesCase{kMixed, "{ring: [8]}", "must be a whole number in [-8, 7]"},
                    NodesCase{kHoney, "{honey: [0]}", "is a thread, whose nodes are made and dropped"},
                    NodesCase{kHoney, "[0]", "threads are written whole"},
                    NodesCase{kPlainRope +
                                  "cloths:\n  - {name: rope, grid: {sides: [[1, 0, 0], [0, 1, 0]], cells: [2, 2]}}\n",
                              "{rope: [0]}", "is the name of a rod and of a cloth"}));

/// The cells of a column of a table, by rows.
std::vector<std::string> cellsOfColumn(const std::string& path, std::size_t index)
{
  std::ifstream file(path);
  std::vector<std::string> cells;
  std::string line;
  std::getline(file, line);   // names
  while (std::getline(file, line))
  {
    std::istringstream row(line);
    std::string cell;
    for (std::size_t k = 0; k <= index; ++k)
      std::getline(row, cell, ',');
    cells.push_back(cell);
  }
  return cells;
}

std::string firstLineWith(const std::string& path, const std::string& part)
{
  std::ifstream file(path);
  std::string line;
  while (std::getline(file, line))
    if (line.find(part) != std::string::npos)
      return line;
  return "none";
}

TEST(RecordNodes, GiveTheRowsOfTables)
{
  const std::string folder = testing::TempDir() + "record_nodes";
  std::filesystem::remove_all(folder);
  const auto write = [&](const std::string& name, const std::vector<std::string>& overrides) {
    std::vector<std::string> all = {"record.fields=[strain, contact_force, energy]"};
    all.insert(all.end(), overrides.begin(), overrides.end());
    const Simulation simulation(parseScene(kMixed, "test.yaml", all));
    CsvTables tables(folder + "/" + name);
    tables.write(snapshotOf(simulation), simulation.config().record.nodes);
    tables.finish();
    return folder + "/" + name;
  };
  const std::string whole = write("whole", {}), some = write("some", {"record.nodes={rope: [-1, 2], flag: [4]}"});
  EXPECT_EQ(cellsOfColumn(whole + "/nodes.csv", 2).size(), 11u + 8u);
  EXPECT_EQ(cellsOfColumn(some + "/nodes.csv", 1),
            (std::vector<std::string>{"rope", "rope", "ring", "ring", "ring", "ring", "ring", "ring", "ring", "ring"}));
  EXPECT_EQ(cellsOfColumn(some + "/nodes.csv", 2),
            (std::vector<std::string>{"2", "10", "0", "1", "2", "3", "4", "5", "6", "7"}));
  EXPECT_EQ(cellsOfColumn(some + "/cloths.csv", 2), (std::vector<std::string>{"4"}));
  EXPECT_EQ(cellsOfColumn(some + "/cloth_fields.csv", 2), (std::vector<std::string>{"4"}));
  EXPECT_EQ(cellsOfColumn(some + "/rod_fields.csv", 2), cellsOfColumn(some + "/nodes.csv", 2));
  // energies are of objects, not of nodes
  EXPECT_EQ(cellsOfColumn(some + "/energies.csv", 1), (std::vector<std::string>{"rope", "ring", "flag"}));
  // a row is the row of the whole table
  for (const char* table : {"/nodes.csv", "/rod_fields.csv"})
    EXPECT_EQ(firstLineWith(some + table, "rope,10,"), firstLineWith(whole + table, "rope,10,")) << table;
  EXPECT_EQ(firstLineWith(some + "/cloths.csv", "flag,4,"), firstLineWith(whole + "/cloths.csv", "flag,4,"));
}

}   // namespace
}   // namespace slender
