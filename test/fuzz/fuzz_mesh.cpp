// OBJ (first byte even) and PLY (odd): read or refused with std::runtime_error; what was read has indices of its own
// vertices and finite numbers.
#include <cstdlib>
#include <stdexcept>

#include "memory_file.h"
#include "slender_sim/geometry/mesh_defects.h"
#include "slender_sim/geometry/mesh_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
  static slender::test::MemoryFile obj("mesh.obj"), ply("mesh.ply");
  if (size == 0)
    return 0;
  slender::test::MemoryFile& file = data[0] % 2 == 0 ? obj : ply;
  file.write(data + 1, size - 1);
  try
  {
    const slender::TriangleMesh mesh = slender::readMesh(file.path());
    if (!mesh.vertices.allFinite() ||
        (mesh.triangles.size() > 0 &&
         (mesh.triangles.minCoeff() < 0 || mesh.triangles.maxCoeff() >= mesh.vertices.cols())))
      std::abort();
    slender::meshDefects(mesh);
    if (&file == &obj)
      slender::readObjGroups(file.path());
  }
  catch (const std::runtime_error&)
  {
  }
  return 0;
}
