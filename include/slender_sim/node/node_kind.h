#pragma once

namespace slender {

/// The nodes that simulate scenes. `scene` runs every scene. Each other node runs the scenes that have an object of its
/// kind.
enum class NodeKind
{
  scene,
  rods,
  threads,
  cloths,
  tracking
};
/// Returns the name of the program, for example "rod_node".
const char* toString(NodeKind kind);

}   // namespace slender
