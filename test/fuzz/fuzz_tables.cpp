// Tables of timed poses (first byte 0 of three), points (1) and sweep plans (2): read or refused with SceneError.
#include <stdexcept>

#include "memory_file.h"
#include "slender_sim/scene/pose_file.h"
#include "slender_sim/scene/reader.h"
#include "slender_sim/scene/sweep_plan.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
  static slender::test::MemoryFile file(".csv");
  if (size == 0)
    return 0;
  file.write(data + 1, size - 1);
  try
  {
    if (data[0] % 3 == 0)
      slender::readPoseFile(file.path());
    else if (data[0] % 3 == 1)
      slender::readPointFile(file.path());
    else
      slender::readSweepPlan(file.path());
  }
  catch (const slender::SceneError&)
  {
  }
  return 0;
}
