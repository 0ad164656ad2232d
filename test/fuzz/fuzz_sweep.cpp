// Sweep plans over scene.yaml: read or refused with SceneError; every run of what was read has its values.
#include <fstream>

#include "memory_file.h"
#include "slender_sim/scene/reader.h"
#include "slender_sim/scene/sweep_plan.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
  static slender::test::MemoryFile scene("scene.yaml"), plan("plan.yaml");
  static const std::string text =
      "rods: [{centerline: {straight: {from: [0, 0, 1], to: [1, 0, 1], edges: 4}}, grasps: {left: {edges: [0]}}}]\n";
  scene.write(reinterpret_cast<const std::uint8_t*>(text.data()), text.size());
  plan.write(data, size);
  try
  {
    const slender::SweepPlan read = slender::readSweepPlan(plan.path());
    for (long k = 0; k < read.points(); ++k)
      read.overrides(k);
  }
  catch (const slender::SceneError&)
  {
  }
  return 0;
}
