// Scene files: read, with the meshes and motions that they describe, or refused with SceneError. Files they name are
// relative to config/scenes.
#include <cstdint>

#include "slender_sim/scene/reader.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
  try
  {
    slender::parseScene(std::string(reinterpret_cast<const char*>(data), size), "fuzz", {},
                        SLENDER_SOURCE_DIR "/config/scenes");
  }
  catch (const slender::SceneError&)
  {
  }
  return 0;
}
