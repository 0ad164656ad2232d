#pragma once

namespace slender {

/// The nodes that simulate scenes. `scene` runs every scene, the others every scene that has an object of their kind.
enum class NodeKind
{
  scene,
  rods,
  threads,
  cloths,
  tracking
};
/// Name of the program.
const char* toString(NodeKind kind);

}   // namespace slender
