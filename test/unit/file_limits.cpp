#include <cmath>
#include <cstdio>
#include <fstream>
#include <iterator>

#include <gtest/gtest.h>
#include <unistd.h>

#include "slender_sim/geometry/mesh_file.h"
#include "slender_sim/scene/reader.h"
#include "slender_sim/scene/simulation.h"
#include "slender_sim/scene/sweep_plan.h"
#include "scene/record/byte_archive.h"

/// What files may ask for: a few bytes must not fill the memory, take for ever, or lead out of what there is.
namespace slender {
namespace {

class FileLimits : public testing::Test
{
protected:
  void TearDown() override { std::remove(path_.c_str()); }

  template <class Use>
  static std::string refusal(const Use& use)
  {
    try
    {
      use();
      return "";
    }
    catch (const std::runtime_error& error)
    {
      return error.what();
    }
  }
  std::string refusalOfPly(const std::string& text) const
  {
    std::ofstream(path_) << text;
    return refusal([&] { readPly(path_); });
  }

  /// Why a state is refused some of whose bytes are replaced, with a checksum that is right again.
  template <class T>
  std::string refusalWith(Simulation& simulation, std::string bytes, std::size_t at, const T& value) const
  {
    constexpr std::size_t header = 5 * 8;
    bytes.replace(at, sizeof value, reinterpret_cast<const char*>(&value), sizeof value);
    Checksum checksum;
    checksum.add(bytes.data() + header, bytes.size() - header);
    const std::uint64_t sum = checksum.value();
    bytes.replace(4 * 8, 8, reinterpret_cast<const char*>(&sum), 8);
    std::ofstream(path_, std::ios::binary | std::ios::trunc) << bytes;
    return refusal([&] { simulation.load(path_); });
  }
  std::string contents() const
  {
    std::ifstream in(path_, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }

  std::string path_ = testing::TempDir() + "/slender_sim_limits_" + std::to_string(getpid());
};

TEST_F(FileLimits, plyFacesNameVerticesByWholeNumbers)
{
  const std::string head =
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\n"
      "property list uchar float vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n";
  EXPECT_EQ(refusalOfPly(head + "3 0 1 2\n"), "");
  for (const char* face : {"3 1 nan 2\n", "3 0 1 1.5\n", "3 0 1 -1\n", "3 0 1 inf\n"})
    EXPECT_NE(refusalOfPly(head + face).find("names a vertex that the file does not have"), std::string::npos)
        << face << refusalOfPly(head + face);
  EXPECT_NE(refusalOfPly(head + "3.5 0 1 2\n").find("list of bad length"), std::string::npos);
}

TEST_F(FileLimits, plyElementsWithoutPropertiesTakeNoTime)
{
  std::string text = "ply\nformat ascii 1.0\n";
  for (int k = 0; k < 1000; ++k)
    text += "element nothing" + std::to_string(k) + " 1000000000\n";   // one by one they would take hours
  EXPECT_NE(refusalOfPly(text + "end_header\n").find("has no faces"), std::string::npos);
}

TEST_F(FileLimits, objFacesAndGroupsMayBeMany)   // compared each with each they would take half an hour
{
  constexpr int n = 1'000'000;
  std::string text, face = "f";
  for (int k = 0; k < n; ++k)
  {
    text += "v 0 0 0\ng g" + std::to_string(k) + "\n";
    face += " " + std::to_string(k + 1);
  }
  std::ofstream(path_) << text << face << "\n";
  EXPECT_EQ(readObj(path_).triangles.cols(), n - 2);
}

TEST_F(FileLimits, scenesHaveAsManyNodesAsFitIntoMemory)
{
  for (const char* scene : {"generate: [{hair: {strands: 100000, edges: 10000}}]\n",
                            "generate: [{chain: {links: 10000, edges: 10000, cross_section: {radius: 0.001}}}]\n",
                            "rods: [{name: a, centerline: &c {straight: {edges: 1000000}}, initial: *c}, {name: b, "
                            "centerline: *c, initial: *c},\n"
                            "       {name: c, centerline: *c, initial: *c}, {name: d, centerline: *c, initial: *c}, "
                            "{name: e, centerline: *c, initial: *c},\n"
                            "       {name: f, centerline: *c}]\n",
                            "generate: [{hair: {strands: 1000, edges: 9990}}]\n"
                            "cloths: [{grid: {sides: [[1, 0, 0], [0, 1, 0]], cells: [100, 100]}}]\n"})
    EXPECT_NE(refusal([&] { parseScene(scene); }).find("all its rods and cloths together may have 10000000"),
              std::string::npos)
        << scene << refusal([&] { parseScene(scene); });
}

TEST_F(FileLimits, treesAreCountedBeforeTheyGrow)
{
  const std::string text = refusal([] { parseScene("generate: [{tree: {levels: 6, children: 30}}]\n"); });
  EXPECT_NE(text.find("too few for 25137931 branches"), std::string::npos) << text;
}

TEST_F(FileLimits, listsOfPlacesNameEachOnce)
{
  std::string ranges = "0..1000000";
  for (int k = 0; k < 100'000; ++k)   // 1e11 places
    ranges += ", 0..999999";
  const std::string text = refusal([&] {
    parseScene("rods: [{centerline: {straight: {edges: 1000000}}, grasps: {g: {nodes: [" + ranges + "]}}}]\n");
  });
  EXPECT_NE(text.find("longer than the 1000001 places"), std::string::npos) << text.substr(0, 300);
}

TEST_F(FileLimits, sweepPlansStopAtTooManyRuns)
{
  std::string axes;
  for (int k = 0; k < 10'000; ++k)   // whose values would be hundreds of gigabytes
    axes += "  a" + std::to_string(k) + ": {from: 0, to: 1, count: 1000000}\n";
  std::ofstream(path_) << "name: plan\nscene: scene.yaml\nmeasures: [rest]\naxes:\n" << axes;
  const std::string text = refusal([&] { readSweepPlan(path_); });
  EXPECT_NE(text.find("at most 1000000"), std::string::npos) << text.substr(0, 300);
}

TEST_F(FileLimits, guidesWhoseBodiesAreMissingAreNotEvaluated)
{
  std::ofstream(path_) << "0,here,0,0,0,0,0,0,1\n";
  const std::string text = refusal([&] {
    parseScene(
        "tracked: [{guide: {grid: {sides: [[1, 0, 0], [0, 1, 0]], cells: 2, pattern: one_diagonal}, motion: {bodies: " +
        path_ + ", groups: {here: [0..2], there: [3..8]}}}, test_functions: {basis: subdivision}}]\n");
  });
  // and nothing is read past the poses that there are, which AddressSanitizer sees
  EXPECT_NE(text.find("has no body there"), std::string::npos) << text;
}

TEST_F(FileLimits, statesOfOneSceneFitItWhateverTheirChecksumSays)
{
  Simulation held(parseScene("rods: [{centerline: {straight: {edges: 4}}, grasps: {left: {edges: [0]}}}]\n"));
  held.save(path_);
  const std::string good = contents();
  constexpr std::size_t header = 5 * 8, nodes = 5, edges = 4;
  constexpr std::size_t x = header + 3 * 8 + 2 * 8;   // time, steps, number of rods; rows and columns
  constexpr std::size_t grasp =
      header + 3 * 8 + 2 * (2 * 8 + nodes * 24) + (2 * 8 + edges * 24) + (2 * 8 + nodes * 8) + (2 * 8 + 24) + 2 * 8 + 8;
  EXPECT_EQ(refusalWith(held, good, x, 0.25), "");
  EXPECT_NE(refusalWith(held, good, x, std::nan("")).find("not finite"), std::string::npos);
  EXPECT_EQ(refusalWith(held, good, grasp, char{0}), "");   // released
  EXPECT_NE(refusalWith(held, good, grasp, char{2}).find("neither yes nor no"), std::string::npos);
  // last node: of one more than it holds
  EXPECT_NE(refusalWith(held, good, grasp + 5, int{1}).find("does not fit together"), std::string::npos);
  // carried by a body that is not there
  EXPECT_NE(refusalWith(held, good, grasp + 10, int{7}).find("does not fit together"), std::string::npos);

  Simulation bare(
      parseScene("time: {step: 1e-4, integrator: symplectic_euler}\nrods: [{centerline: {straight: {edges: 4}}}]\n"));
  bare.save(path_);
  const std::string frameless = contents();
  // after frames and twists, which are not there
  constexpr std::size_t director = header + 3 * 8 + 2 * (2 * 8 + nodes * 24) + 3 * 2 * 8;
  EXPECT_EQ(refusalWith(bare, frameless, director + 8, 0.0), "");
  EXPECT_NE(refusalWith(bare, frameless, director + 16, 0.5).find("do not fit it"), std::string::npos);
}

}   // namespace
}   // namespace slender
