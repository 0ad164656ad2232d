// Saved states: loaded or refused with std::runtime_error, and what was loaded steps or refuses to. The header is made
// to fit, or nothing would pass it.
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <stdexcept>

#include "memory_file.h"
#include "slender_sim/scene/reader.h"
#include "slender_sim/scene/simulation.h"
#include "scene/record/byte_archive.h"

namespace {

constexpr const char* kScene = R"(
time: {newton: {max_iterations: 5, max_cuts: 1}}
rods: [{centerline: {straight: {from: [0, 0, 1], to: [1, 0, 1], edges: 3}}, grasps: {left: {edges: [0]}}, damping: {stiffness: 0.01}}]
threads: [{nozzle: {diameter: 0.005, position: [0, 5, 0], flow: 1.0e-7}}]
bodies: [{name: ball, shape: {sphere: {radius: 0.05}}, mass: 1, pose: {position: [0, 2, 0]}}]
obstacles: [{name: floor, shape: {plane: {}}}]
cloths: [{name: flag, grid: {corner: [0, 0, 1], sides: [[0.1, 0, 0], [0, 0.1, 0]], cells: 2}, grasps: {pole: {vertices: [0, 1]}}}]
tracked: [{guide: {cloth: flag}, mesh: {subdivide: 1}, test_functions: {basis: subdivision, vertices: [2, 3]}}]
)";

}   // namespace

using namespace slender;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
  static test::MemoryFile file("saved.state");
  static Simulation simulation(parseScene(kScene));
  static const std::string beginning = [] {
    const std::string whole = file.path() + "_whole";
    simulation.save(whole);
    std::ifstream in(whole, std::ios::binary);
    std::string bytes{std::istreambuf_iterator<char>(in), {}};
    if (const char* seed = std::getenv("SEED_FILE"))   // for the first corpus
      std::ofstream(seed, std::ios::binary) << bytes.substr(5 * sizeof(std::uint64_t));
    unlink(whole.c_str());
    bytes.resize(3 * sizeof(std::uint64_t));   // magic, version, fingerprint
    return bytes;
  }();
  Checksum checksum;
  checksum.add(data, size);
  std::string bytes = beginning;
  for (const std::uint64_t word : {static_cast<std::uint64_t>(size), checksum.value()})
    bytes.append(reinterpret_cast<const char*>(&word), sizeof word);
  bytes.append(reinterpret_cast<const char*>(data), size);
  file.write(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
  try
  {
    simulation.load(file.path());
    simulation.step(simulation.defaultInputs());
    if (!simulation.state().rods[0].x.allFinite() || !simulation.state().cloths[0].x.allFinite())
      std::abort();
  }
  catch (const std::runtime_error&)
  {
  }
  simulation.reset();   // each execution for itself
  return 0;
}
