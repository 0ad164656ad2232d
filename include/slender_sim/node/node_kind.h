#pragma once

namespace slender {

/// What a node simulates, and its name in what it prints.
enum class NodeKind
{
  rods,
  threads,
  cloths,
  tracking
};
const char* toString(NodeKind kind);

}   // namespace slender
