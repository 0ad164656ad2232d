// Scene files: read or refused with SceneError, nothing else.
#include <cstdint>

#include "slender_sim/scene/reader.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
  try
  {
    slender::parseScene(std::string(reinterpret_cast<const char*>(data), size), "fuzz", {}, "/nonexistent");
  }
  catch (const slender::SceneError&)
  {
  }
  return 0;
}
