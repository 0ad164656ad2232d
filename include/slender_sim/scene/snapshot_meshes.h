#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "slender_sim/geometry/tube_mesh.h"
#include "slender_sim/scene/snapshot.h"

/// Surfaces of what was recorded, for pictures and other programs.
namespace slender {

/// Edges without volume at a thread's ends, the insides of holders, are left out.
FramedLine lineOf(const RodSnapshot& rod);
/// `values`: per node, or none.
FramedLine lineOf(const ThreadSnapshot& thread, const std::vector<double>& values = {});

/// Surface of a solid about the origin; round ones have their vertices on the true surface. A plane has none.
TriangleMesh shapeMesh(const Shape& shape);

enum class ObjectKind
{
  rod,
  thread,
  cloth,
  body,
  obstacle,
  gripper,
  nozzle
};

struct ObjectMesh
{
  ObjectKind kind = ObjectKind::rod;
  std::string name;    ///< of a piece that broke off a thread: NAME_ID
  int index = 0;       ///< among those of its kind
  TriangleMesh mesh;   ///< world axes [m]
  /// meshes of an object with equal keys have the same triangles, and vertices that stay on their material
  std::vector<std::uint64_t> key;
};

struct TubeResolution
{
  int sides = 16;
  int sections = 800;   ///< wanted per rod or thread; one through each node at least
};

/// One per rod, thread and piece of it, and cloth; with `scene` one per body and obstacle that has a shape other than a
/// plane. Throws std::invalid_argument: a cloth whose triangles were not recorded.
std::vector<ObjectMesh> objectMeshes(const SceneSnapshot& instant, const SceneConfig* scene,
                                     const TubeResolution& resolution);

}   // namespace slender
