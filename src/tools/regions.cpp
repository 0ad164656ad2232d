#include <algorithm>
#include <chrono>
#include <cstdio>
#include <exception>
#include <optional>
#include <string>
#include <vector>

#include "arguments.h"
#include "program_main.h"
#include "slender_sim/geometry/mesh_file.h"
#include "slender_sim/scene/reader.h"
#include "slender_sim/tracking/function_colors.h"

/// regions IN OUT: shows the test functions of tracking as colours of a mesh. Exit status 0 done, 2 bad input.
namespace {

using slender::BadInput, slender::parseCount, slender::parseNumber;

const char* const usage =
    "usage: regions SCENE.yaml OUT [options]    test functions of a scene's tracked cloth\n"
    "       regions MESH OUT --count N [options]    regions found by clustering the faces of a mesh\n"
    "  OUT                 coloured mesh: .ply or .obj (colours behind the coordinates)\n"
    "  --object NAME       of several tracked cloths (default: the first)\n"
    "  --functions NAME    of several sets of test functions (default: the first)\n"
    "  --guide             the guide's mesh with its functions instead of the tracked one\n"
    "  --set PATH=VALUE    override a value of the scene; may be repeated\n"
    "  --count N           regions\n"
    "  --frames PATTERN    the mesh's motion, e.g. walk/frame_*.obj: regions suit all frames (default: the mesh at "
    "rest)\n"
    "  --compactness MU    from 0, flat regions, to 1, compact ones (default: 0.5)\n"
    "  --seed S            of the first regions and the choice of frames (default: 1)\n"
    "  --sampled-frames N  of all frames (default: 20)\n"
    "  --quiet             print nothing but errors\n"
    "Exit status: 0 done, 2 bad input.\n";

struct Options
{
  std::vector<std::string> files, overrides;
  std::string object, functions, frames;
  std::optional<int> count;
  double compactness = 0.5;
  int seed = 1, sampled = 20;
  bool guide = false, quiet = false, help = false;
};

Options parseOptions(int argc, char** argv)
{
  Options options;
  bool clustering = false;
  for (int k = 1; k < argc; ++k)
  {
    const std::string argument = argv[k];
    const auto value = [&]() -> std::string {
      if (k + 1 >= argc)
        throw BadInput(argument + ": its value is missing\n" + usage);
      return argv[++k];
    };
    if (argument == "--object")
      options.object = value();
    else if (argument == "--functions")
      options.functions = value();
    else if (argument == "--set")
      options.overrides.push_back(value());
    else if (argument == "--count")
      options.count = parseCount(argument, value(), 1, 1000000);
    else if (argument == "--frames")
      options.frames = value(), clustering = true;
    else if (argument == "--compactness")
    {
      const std::string text = value();
      if (!parseNumber(text, options.compactness) || options.compactness < 0 || options.compactness > 1)
        throw BadInput(argument + " " + text + ": must be a number in [0, 1]");
      clustering = true;
    }
    else if (argument == "--seed")
      options.seed = parseCount(argument, value(), 0, 2000000000), clustering = true;
    else if (argument == "--sampled-frames")
      options.sampled = parseCount(argument, value(), 1, 10000), clustering = true;
    else if (argument == "--guide")
      options.guide = true;
    else if (argument == "--quiet")
      options.quiet = true;
    else if (argument == "--help" || argument == "-h")
      options.help = true;
    else if (argument.size() > 1 && argument[0] == '-')
      throw BadInput(argument + ": no such option\n" + usage);
    else
      options.files.push_back(argument);
  }
  if (options.help)
    return options;
  if (options.files.size() != 2)
    throw BadInput(std::string("needs IN and OUT\n") + usage);
  slender::requireMeshName(options.files[1]);
  const std::string& in = options.files[0];
  const auto dot = in.rfind('.');
  if (!options.count && dot != std::string::npos && (in.substr(dot) == ".obj" || in.substr(dot) == ".ply"))
    throw BadInput(in +
                   ": is a mesh; say into how many regions to divide it: --count N (or give a scene, whose test "
                   "functions are shown)");
  if (!options.count && clustering)
    throw BadInput("--frames, --compactness, --seed and --sampled-frames cluster a mesh: give --count as well");
  return options;
}

std::string quoted(const std::string& text)
{
  std::string out = "\"";
  for (const char c : text)
    out += c == '"' || c == '\\' ? std::string("\\") + c : std::string(1, c);
  return out + "\"";
}

/// A mesh to be clustered is a scene in which it tracks itself.
slender::SceneConfig clusteringScene(const Options& o)
{
  char numbers[120];
  std::snprintf(numbers, sizeof numbers, "count: %d, compactness: %.17g, seed: %d, frames: %d", *o.count, o.compactness,
                o.seed, o.sampled);
  const std::string text = "tracked:\n  - guide: {mesh: {file: " + quoted(o.files[0]) + "}" +
                           (o.frames.empty() ? "" : ", motion: {frames: " + quoted(o.frames) + ", rate: 30}") +
                           "}\n    mesh: same\n    test_functions: {clusters: {" + numbers + "}}\n";
  return slender::parseScene(text, o.files[0], o.overrides);
}

int run(const Options& options)
{
  const auto start = std::chrono::steady_clock::now();
  const slender::SceneConfig scene =
      options.count ? clusteringScene(options) : slender::readScene(options.files[0], options.overrides);
  const slender::ClothConfig* cloth = nullptr;
  for (const slender::ClothConfig& candidate : scene.cloths)
    if (!cloth && candidate.tracking && (options.object.empty() || options.object == candidate.name))
      cloth = &candidate;
  if (!cloth)
    throw BadInput(options.files[0] + ": has no tracked cloth" + (options.object.empty() ? "" : " " + options.object));
  const slender::TrackingConfig& tracking = *cloth->tracking;
  const auto set = std::find_if(tracking.sets.begin(), tracking.sets.end(), [&](const slender::FunctionSet& s) {
    return options.functions.empty() || options.functions == s.name;
  });
  if (set == tracking.sets.end())
    throw BadInput(options.files[0] + ": tracked cloth " + cloth->name + " has no test functions " + options.functions);
  const slender::TestFunctions::Values& values = options.guide ? set->functions.guide : set->functions.tracked;
  const slender::TriangleMesh& mesh = options.guide ? tracking.guide.mesh : cloth->mesh;
  slender::writeColoredMesh(options.files[1], mesh, slender::functionColors(values));
  if (options.quiet)
    return slender::kDone;
  Eigen::Index fewest = values.cols(), most = 0;
  for (Eigen::Index i = 0; i < values.rows(); ++i)
  {
    const Eigen::Index vertices = values.row(i).nonZeros();
    fewest = std::min(fewest, vertices);
    most = std::max(most, vertices);
  }
  std::printf("object            %s\n", cloth->name.c_str());
  std::printf("vertices          %ld\n", static_cast<long>(mesh.vertices.cols()));
  std::printf("test functions    %d, over %ld to %ld vertices\n", set->functions.count(), static_cast<long>(fewest),
              static_cast<long>(most));
  std::printf("wall              %.3g s\n",
              std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  return slender::kDone;
}

}   // namespace

int main(int argc, char** argv) { return slender::programMain("regions", usage, argc, argv, parseOptions, run); }
