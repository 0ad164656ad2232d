// Scenes that can be read: made into a simulation, or refused by a std::runtime_error, nothing else. Files they name
// are relative to config/scenes.
#include <cstdint>
#include <stdexcept>

#include "slender_sim/scene/reader.h"
#include "slender_sim/scene/simulation.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
  try
  {
    slender::SceneConfig config = slender::parseScene(std::string(reinterpret_cast<const char*>(data), size), "fuzz",
                                                      {}, SLENDER_SOURCE_DIR "/config/scenes");
    config.start = {};   // an equilibrium may take its time
    slender::Simulation(std::move(config));
  }
  catch (const std::runtime_error&)   // SceneError, SimulationError
  {
  }
  return 0;
}
