#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <exception>
#include <optional>
#include <string>
#include <vector>

#include "arguments.h"
#include "program_main.h"
#include "slender_sim/fairing/fair_mesh.h"
#include "slender_sim/geometry/mesh_file.h"

/// fair_mesh IN OUT: smooths meshes and closes their holes by Willmore flow. Exit status 0 done, 2 bad input, 3 the
/// fairing failed.
namespace {

using slender::BadInput, slender::parseCount, slender::parseNumber, slender::parsePositive;
using Clock = std::chrono::steady_clock;

const char* const usage =
    "usage: fair_mesh IN OUT [options]\n"
    "  IN, OUT             meshes, .obj or .ply [m]\n"
    "  --steps N           steps of the Willmore flow (default: 10; with --fill-holes 0)\n"
    "  --smoothing L       length [m]: a step halves bumps of wavelength 2 pi L, longer ones less (default: the mean "
    "edge length)\n"
    "  --region X,Y,Z,R    only vertices in this ball move [m]; may be repeated\n"
    "  --fill-holes        first close the holes by patches that continue the surface around them\n"
    "  --largest-hole N    leave boundaries of more than N edges open (default: 1000)\n"
    "  --edge-length L     of the patches [m] (default: that around each hole)\n"
    "  --quiet             print nothing but errors\n"
    "A boundary and the vertices next to it keep their places. Exit status: 0 done, 2 bad input, 3 the fairing failed "
    "(no OUT then).\n";

struct Options
{
  std::vector<std::string> files;
  slender::FairingOptions fairing;
  std::optional<int> steps;
  bool quiet = false, help = false;
};

slender::FairingOptions::Ball parseBall(const std::string& name, const std::string& text)
{
  double numbers[4];
  std::size_t begin = 0;
  for (int k = 0; k < 4; ++k)
  {
    const std::size_t comma = text.find(',', begin);
    if ((comma == std::string::npos) != (k == 3) || !parseNumber(text.substr(begin, comma - begin), numbers[k]) ||
        (k == 3 && !(numbers[3] > 0)))
      throw BadInput(name + " " + text + ": must be X,Y,Z,R, the middle and the positive radius of a ball");
    begin = comma + 1;
  }
  return {{numbers[0], numbers[1], numbers[2]}, numbers[3]};
}

Options parseOptions(int argc, char** argv)
{
  Options options;
  for (int k = 1; k < argc; ++k)
  {
    const std::string argument = argv[k];
    const auto value = [&]() -> std::string {
      if (k + 1 >= argc)
        throw BadInput(argument + ": its value is missing\n" + usage);
      return argv[++k];
    };
    if (argument == "--steps")
      options.steps = parseCount(argument, value(), 0, 1000000);
    else if (argument == "--smoothing")
      options.fairing.smoothing = parsePositive(argument, value());
    else if (argument == "--region")
      options.fairing.region.push_back(parseBall(argument, value()));
    else if (argument == "--fill-holes")
      options.fairing.fill_holes = true;
    else if (argument == "--largest-hole")
      options.fairing.largest_hole = parseCount(argument, value(), 3, slender::kLongestHole);
    else if (argument == "--edge-length")
      options.fairing.edge_length = parsePositive(argument, value());
    else if (argument == "--quiet")
      options.quiet = true;
    else if (argument == "--help" || argument == "-h")
      options.help = true;
    else if (argument.size() > 1 && argument[0] == '-')
      throw BadInput(argument + ": unknown option\n" + usage);
    else
      options.files.push_back(argument);
  }
  if (!options.help && options.files.size() != 2)
    throw BadInput(std::string("one mesh to read and one to write are needed\n") + usage);
  options.fairing.steps = options.steps.value_or(options.fairing.fill_holes ? 0 : 10);
  return options;
}

/// A bar on a terminal; nothing when the output goes elsewhere.
class Progress
{
public:
  explicit Progress(bool on) : on_(on) {}
  ~Progress() { clear(); }

  void show(const char* what, std::size_t done, std::size_t total)
  {
    const auto now = Clock::now();
    if (!on_ || now - last_ < std::chrono::milliseconds(100))
      return;
    last_ = now;
    shown_ = true;
    constexpr std::size_t width = 40;
    const std::size_t filled = width * done / total;
    std::fprintf(stderr, "\r[%s%s] %s %zu of %zu  ", std::string(filled, '#').c_str(),
                 std::string(width - filled, '.').c_str(), what, done, total);
  }

  void clear()
  {
    if (shown_)
      std::fprintf(stderr, "\r\033[K");
    shown_ = false;
  }

private:
  bool on_, shown_ = false;
  Clock::time_point last_{};
};

int run(const Options& options)
{
  const auto start = Clock::now();
  const std::string &in = options.files[0], &out = options.files[1];
  slender::TriangleMesh mesh = slender::readMesh(in);
  slender::requireMeshName(out);
  const bool fills = options.fairing.fill_holes, flows = options.fairing.steps > 0;
  slender::FairingSummary summary;
  {
    Progress progress(!options.quiet && ::isatty(STDERR_FILENO));
    summary = slender::fairMesh(
        mesh, in, options.fairing,
        [&progress](const char* what, std::size_t done, std::size_t total) { progress.show(what, done, total); });
  }
  if (!summary.ok)
  {
    std::fprintf(stderr, "fair_mesh: %s\n", summary.message.c_str());
    return slender::kFailed;
  }
  slender::writeMesh(out, mesh);
  if (options.quiet)
    return slender::kDone;
  std::printf("mesh              %s, %ld vertices, %ld faces\n", out.c_str(), static_cast<long>(mesh.vertices.cols()),
              static_cast<long>(mesh.triangles.cols()));
  if (fills)
    std::printf("holes             %d closed by %d vertices, %d left open\n", summary.holes, summary.patch_vertices,
                summary.open_holes);
  if (flows)
    std::printf("steps             %d%s, %d halvings\n1/2 int H^2       %.6g, was %.6g (a sphere has 8 pi = 25.13)\n",
                summary.steps, summary.stationary ? " (stationary)" : "", summary.cuts, summary.energy,
                summary.energy_before);
  std::printf("wall              %.4g s\n", std::chrono::duration<double>(Clock::now() - start).count());
  return slender::kDone;
}

}   // namespace

int main(int argc, char** argv) { return slender::programMain("fair_mesh", usage, argc, argv, parseOptions, run); }
