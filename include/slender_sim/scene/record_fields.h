#pragma once

#include <string>
#include <utility>
#include <vector>

namespace slender {

/// Quantities that `record: {fields: [...]}` adds to what is recorded. Nothing is computed of those that are not named.
enum class RecordField
{
  curvature,       ///< of rods, per node
  twist,           ///< of rods, per node
  strain,          ///< of rods, per edge
  force,           ///< internal force of rods, per edge
  moment,          ///< internal moment of rods, per node
  energy,          ///< per rod, cloth and simulated body
  contact_force,   ///< of rods and cloths, per node or vertex; the sum on an obstacle or a body
};

/// Every field under its name in scene files.
const std::vector<std::pair<std::string, RecordField>>& recordFieldNames();

}   // namespace slender
