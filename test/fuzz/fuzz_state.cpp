// Saved states: loaded or refused with std::runtime_error, and what was loaded steps or refuses to. The header is made to fit, or nothing would pass it.
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <stdexcept>

#include "memory_file.h"
#include "slender_sim/scene/reader.h"
#include "slender_sim/scene/simulation.h"
#include "src/scene/byte_archive.h"

namespace {

constexpr const char* kScene = R"(
rods: [{centerline: {straight: {from: [0, 0, 1], to: [1, 0, 1], edges: 4}}, grasps: {left: {edges: [0]}}}]
cloths: [{grid: {corner: [0, 0, 1], sides: [[0.1, 0, 0], [0, 0.1, 0]], cells: 2}, grasps: {pole: {edge: left}}}]
)";

}  // namespace

using namespace slender;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
  static test::MemoryFile file(".state");
  static Simulation simulation(parseScene(kScene));
  static const std::string beginning = [] {
    const std::string path = file.path() + ".whole";
    simulation.save(path);
    std::ifstream in(path, std::ios::binary);
    std::string bytes(3 * sizeof(std::uint64_t), '\0');   // magic, version, fingerprint
    in.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    std::filesystem::remove(path);
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
    if (!simulation.state().rods[0].x.allFinite() || !simulation.state().cloths[0].cloth.x.allFinite())
      std::abort();
  }
  catch (const std::runtime_error&)
  {
  }
  return 0;
}
