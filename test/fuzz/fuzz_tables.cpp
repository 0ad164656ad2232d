// Tables of timed poses (first byte even) and of points (odd): read or refused with SceneError. What was read can be
// evaluated.
#include <cstdlib>

#include "memory_file.h"
#include "slender_sim/scene/pose_file.h"
#include "slender_sim/scene/reader.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
  static slender::test::MemoryFile file("table.csv");
  if (size == 0)
    return 0;
  file.write(data + 1, size - 1);
  try
  {
    if (data[0] % 2 == 1)
    {
      for (const Eigen::Vector3d& point : slender::readPointFile(file.path()))
        if (!point.allFinite())
          std::abort();
      return 0;
    }
    for (const slender::BodyTrajectory& body : slender::readPoseFile(file.path()))
      for (const double share : {-1.0, 0.0, 0.3, 1.0, 2.0})
      {
        slender::Twist velocity;
        const slender::Pose pose =
            body.poses.evaluate(body.poses.firstTime() * (1 - share) + body.poses.lastTime() * share, &velocity);
        if (!(std::abs(pose.orientation.norm() - 1.0) < 1e-6))
          std::abort();
      }
  }
  catch (const slender::SceneError&)
  {
  }
  return 0;
}
